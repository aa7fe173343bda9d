#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "bag/wire_reader.hpp"
#include "file_bytes.hpp"

namespace scanloc::limits {

/// Largest chunk of a bag, compressed or not, and largest message in it [bytes].
inline constexpr std::uint64_t kMaxBagChunkBytes = 1ULL << 30;
/// Largest file that a compressed bag is decompressed to [bytes].
inline constexpr std::uint64_t kMaxBagFileBytes = 1ULL << 40;

}  // namespace scanloc::limits

namespace scanloc::dataset {

/// A topic of one file.
struct FileTopic {
  std::string name;
  std::string type;  ///< without "msg/": sensor_msgs/PointCloud2
  WireFormat format = WireFormat::kOther;
};

/// Where a message lies in its file; in the order of the file.
struct MessageRef {
  std::int64_t log_time_ns = 0;
  std::uint32_t topic = 0;  ///< index of the file's topics
  std::uint32_t chunk = 0;  ///< messages of one chunk are best read soon after each other
  std::uint64_t at = 0;     ///< of the chunk, or the row of a table
};

/// The bytes of a message, which lie in `holder`.
struct MessageBytes {
  std::shared_ptr<const FileBytes> holder;
  std::string_view bytes;
};

/// One recorded file, opened and indexed.
class BagFile {
 public:
  virtual ~BagFile() = default;

  [[nodiscard]] const std::vector<FileTopic>& topics() const { return topics_; }
  [[nodiscard]] const std::vector<MessageRef>& messages() const { return messages_; }
  /// What a user should know: that the file was cut off, and the like.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

  void AddNote(std::string note) { notes_.push_back(std::move(note)); }

  /// Reads a message of this file; any number of threads at once. DataLoss if it is damaged.
  [[nodiscard]] virtual absl::StatusOr<MessageBytes> Read(const MessageRef& message) const = 0;

 protected:
  std::vector<FileTopic> topics_;
  std::vector<MessageRef> messages_;
  std::vector<std::string> notes_;
};

/// "sensor_msgs/msg/PointCloud2" as "sensor_msgs/PointCloud2".
[[nodiscard]] std::string ShortType(std::string_view type);

/// Opens a file by what it begins with: MCAP, ROS 1's bag, or a database of rosbag2; a whole file
/// compressed by zstd is decompressed into a temporary one. InvalidArgument if it is none of them
/// or of another version.
[[nodiscard]] absl::StatusOr<std::unique_ptr<BagFile>> OpenBagFile(const std::string& path);

[[nodiscard]] absl::StatusOr<std::unique_ptr<BagFile>> OpenMcap(const std::string& path);
[[nodiscard]] absl::StatusOr<std::unique_ptr<BagFile>> OpenRos1Bag(const std::string& path);
[[nodiscard]] absl::StatusOr<std::unique_ptr<BagFile>> OpenRos2Database(const std::string& path);

}  // namespace scanloc::dataset
