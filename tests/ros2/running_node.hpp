#pragma once

#include <functional>
#include <string>

#include "e2e/programs.hpp"
#include "ros2/ros_peer.hpp"
#include "ros2/ros_wire.hpp"
#include "support/process.hpp"

namespace scanloc::test {

/// scanloc-ros2 as a process, and its robot as the other implementation of DDS has it, on a domain
/// of their own.
class RunningNode {
 public:
  /// Starts it with --domain and the arguments, and waits until it is ready and both sides have
  /// found each other on the topics; on those of clouds and the initial pose if they are not named.
  explicit RunningNode(const Args& args,
                       RosPeer::Reliability reliability = RosPeer::Reliability::kBestEffort);

  /// Publishes the scan of a drive of Town() as a cloud.
  void SendScan(const std::string& drive, int scan, std::int64_t stamp_ns);

  /// The first diagnosis that is as wanted; throws with the last one if none is within kPatience.
  DiagnosisHeard WaitForDiagnosis(const std::function<bool(const DiagnosisHeard&)>& is_wanted);
  DiagnosisHeard WaitForMessage(const std::string& part);

  DomainLease domain;
  RosPeer robot;
  Process process;
};

/// Takes connections and never says a word.
class SilentServer {
 public:
  SilentServer();
  ~SilentServer();
  SilentServer(const SilentServer&) = delete;
  SilentServer& operator=(const SilentServer&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  int fd_ = -1;
  std::string address_;
};

/// x, y, z of the answer that `scanloc locate` gives for the scan of a drive of Town().
Eigen::Vector3d AnswerOfCommandLine(const std::string& drive, int scan);

PointCloud ScanOf(const std::string& drive, int scan);

inline constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

}  // namespace scanloc::test
