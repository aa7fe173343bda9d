#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc::dataset {

/// How the messages of a topic are written.
enum class WireFormat {
  kCdr,    ///< ROS 2: aligned, after four bytes that name the byte order
  kRos1,   ///< ROS 1: packed, little endian
  kOther,  ///< not read
};

/// A topic of a bag.
struct BagTopic {
  std::string name;
  std::string type;  ///< without "msg/": sensor_msgs/PointCloud2
  WireFormat format = WireFormat::kOther;
  std::size_t num_messages = 0;
  std::int64_t first_ns = 0;  ///< when its first message was recorded
  std::int64_t last_ns = 0;
};

/// A message of a bag. The bytes are there until the handler returns.
struct BagMessage {
  const BagTopic* topic;
  std::int64_t log_time_ns;  ///< when it was recorded
  std::string_view bytes;
  std::size_t id;  ///< for Bag::Read
};

/// What of a bag is damaged.
struct BagDamage {
  std::map<std::string, std::size_t> num_messages;  ///< that cannot be read, by topic
  std::string first;                                ///< where, and how it is known

  [[nodiscard]] bool empty() const { return num_messages.empty(); }
  /// A sentence without an end.
  [[nodiscard]] std::string Text() const;
};

/// Recorded messages of a robot: files of MCAP (zstd, lz4, with an index or without), databases of
/// rosbag2 (compressed or not, whole or message by message), bags of ROS 1 (bz2, lz4), or folders
/// of them, several files as one. Of a file that is cut off, what comes before is there; of one
/// that is damaged, whatever can be read. Checksums are looked at where there are any.
///
/// Opening reads the index, or all of a file that has none; messages are read one by one. Any
/// number of threads may use a bag at once.
class Bag {
 public:
  /// NotFound: no such file. InvalidArgument, with the file and the reason: no bag, damaged, of
  /// another version, an empty folder, or two files that give a topic different types.
  [[nodiscard]] static absl::StatusOr<std::shared_ptr<const Bag>> Open(
      const std::vector<std::string>& paths);

  ~Bag();

  /// By name.
  [[nodiscard]] const std::vector<BagTopic>& topics() const { return topics_; }
  /// Sentences without an end: which file is cut off or damaged, and the like.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

  /// Null if there is none of this name.
  [[nodiscard]] const BagTopic* FindTopic(std::string_view name) const;

  using Handler = std::function<absl::Status(const BagMessage& message)>;
  /// Calls `handle` for the messages of these topics in the order in which they were recorded, and
  /// returns the first status that is not ok. Messages that are damaged are passed over and told in
  /// `damage`; without it they are DataLoss.
  [[nodiscard]] absl::Status ForEach(const std::vector<const BagTopic*>& topics,
                                     const Handler& handle, BagDamage* damage = nullptr) const;

  /// The messages of these topics in that order, not read yet.
  [[nodiscard]] std::vector<std::size_t> Messages(const std::vector<const BagTopic*>& topics) const;

  /// Calls `handle` for one message. DataLoss if it is damaged.
  [[nodiscard]] absl::Status Read(std::size_t id, const Handler& handle) const;

 private:
  struct Impl;
  explicit Bag(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
  std::vector<BagTopic> topics_;
  std::vector<std::string> notes_;
};

}  // namespace scanloc::dataset
