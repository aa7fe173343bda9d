#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

/// The other side of a robot's topics, over another implementation of DDS than the program's:
/// Fast DDS. On loopback only.
namespace scanloc::test {

/// A DDS domain that no other test on this machine uses meanwhile.
class DomainLease {
 public:
  /// Throws std::runtime_error if all are taken.
  DomainLease();
  ~DomainLease();
  DomainLease(const DomainLease&) = delete;
  DomainLease& operator=(const DomainLease&) = delete;

  [[nodiscard]] int domain() const { return domain_; }

 private:
  int domain_ = -1;
  int fd_ = -1;
};

/// CYCLONEDDS_URI=... that keeps a program of Cyclone DDS on loopback, where it finds RosPeer.
std::string CycloneOnLoopback();

/// Publishes and receives messages as their bytes in CDR, head included.
class RosPeer {
 public:
  static constexpr std::chrono::seconds kPatience{30};

  explicit RosPeer(int domain);
  ~RosPeer();
  RosPeer(const RosPeer&) = delete;
  RosPeer& operator=(const RosPeer&) = delete;

  enum class Reliability { kBestEffort, kReliable };
  enum class Durability { kVolatile, kTransientLocal };

  /// A topic as ROS knows it, of a type such as "sensor_msgs/PointCloud2". Once a topic.
  void Advertise(const std::string& topic, const std::string& type,
                 Reliability reliability = Reliability::kReliable,
                 Durability durability = Durability::kTransientLocal);
  void Subscribe(const std::string& topic, const std::string& type,
                 Durability durability = Durability::kVolatile);

  /// Waits until somebody else reads, or writes, the topic; false if nobody does.
  [[nodiscard]] bool WaitForReader(const std::string& topic);
  [[nodiscard]] bool WaitForWriter(const std::string& topic);

  /// False if DDS does not take it.
  bool Publish(const std::string& topic, const std::string& bytes);

  /// The next message of a topic; none within the time.
  [[nodiscard]] std::optional<std::string> Next(const std::string& topic,
                                                std::chrono::milliseconds within = kPatience);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace scanloc::test
