#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "bag/bag_file.hpp"
#include "bag/chunk_cache.hpp"
#include "bag/decompress.hpp"
#include "bag/random_file.hpp"
#include "bag/spare_memory.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::dataset {

/// What MCAP and ROS 1's bags share: records, of which some are chunks of compressed records, with
/// an index of its messages behind each, which may be missing.
class ChunkedFile : public BagFile {
 public:
  [[nodiscard]] absl::StatusOr<MessageBytes> Read(const MessageRef& message) const override;

 protected:
  explicit ChunkedFile(RandomFile file) : file_(std::move(file)) {}

  [[nodiscard]] const RandomFile& file() const { return file_; }

  /// A chunk whose compressed records are num_stored bytes at `offset` of the file, fewer than it
  /// announces where the file is cut off. `checksum` is that of its records, 0 where none is told.
  /// A message outside of any is a chunk of its own.
  struct Chunk {
    std::uint64_t offset = 0;
    std::uint64_t num_stored = 0;
    std::uint64_t num_bytes = 0;
    Compression compression = Compression::kNone;
    std::uint32_t checksum = 0;
    bool is_cut_off = false;
    bool is_indexed = false;
  };
  [[nodiscard]] absl::Status AddChunk(const Chunk& chunk);
  void AddMessage(std::uint32_t channel, std::int64_t log_time_ns, std::uint64_t at);
  /// The chunk added last, of which what follows is told.
  [[nodiscard]] Chunk* last_chunk() { return chunks_.empty() ? nullptr : &chunks_.back(); }
  void AddChannel(std::uint32_t channel, FileTopic topic) {
    channels_.emplace(channel, std::move(topic));
  }

  /// Reads the chunks that have no index, or whose channels are not known, and makes topics and
  /// messages of what there is. `cut_off` says how the file is cut off ("ends within ..."); so may
  /// be the index of the last chunk then. It is empty for a file that is whole.
  [[nodiscard]] absl::Status FinishIndex(std::string_view cut_off);
  /// Whether a damaged bit could go unnoticed in some message, but for a checksum of the whole.
  [[nodiscard]] bool HasUncheckedMessages() const;
  /// What a user should know, after the name of the file.
  void AddNoteOfFile(std::string_view note);

  /// Calls AddChannel and, where the chunk has no index, AddMessage for the records of a chunk.
  /// Stops at what is no record or not whole: DataLoss.
  virtual absl::Status ScanRecords(std::string_view records, bool with_messages) = 0;

  struct Record {
    std::uint32_t channel;
    std::int64_t log_time_ns;
    std::string_view payload;
  };
  /// The message record at `at`, if there is one and it is whole.
  [[nodiscard]] virtual std::optional<Record> RecordAt(std::string_view records,
                                                       std::uint64_t at) const = 0;

 private:
  /// Whether a chunk's bytes are those that its checksum tells of.
  enum class Checked : char { kNotYet, kRight, kDamaged };

  /// Compares the checksum of a chunk's bytes with the one told.
  [[nodiscard]] absl::Status Check(std::uint32_t i, std::uint32_t checksum) const;
  /// DataLoss if it is known to be damaged.
  [[nodiscard]] absl::Status StatusOf(std::uint32_t i) const;
  /// The same of a chunk that is not compressed, without holding it in memory.
  [[nodiscard]] absl::Status CheckStored(std::uint32_t i) const;
  [[nodiscard]] absl::StatusOr<FileBytes> ReadStored(std::uint64_t offset,
                                                     std::uint64_t num_bytes) const;
  [[nodiscard]] absl::StatusOr<FileBytes> ReadChunk(std::uint32_t i) const;
  /// Of a chunk that is not compressed nothing else is read.
  [[nodiscard]] absl::StatusOr<MessageBytes> ReadStoredMessage(const MessageRef& message) const;
  /// The payload of the record at `at`, which is to be of this message.
  [[nodiscard]] absl::StatusOr<std::string_view> Payload(const FileBytes& records, std::uint64_t at,
                                                         const MessageRef& message) const;
  /// Begins to read the next chunks of a topic that is read chunk after chunk.
  void ReadAhead(const MessageRef& message) const;
  /// A chunk that is damaged gives what can be read of it, and a note.
  [[nodiscard]] absl::Status ScanChunk(std::uint32_t i, bool with_messages);
  void MakeTopics();

  RandomFile file_;
  const std::shared_ptr<SpareMemory> memory_ = std::make_shared<SpareMemory>();
  std::vector<Chunk> chunks_;
  // By chunk: who reads one again need not look again.
  mutable std::deque<std::atomic<Checked>> checked_;
  std::map<std::uint32_t, FileTopic> channels_;
  std::vector<std::uint32_t> channel_of_;  ///< by topic
  // The chunk that AddMessage is called for, if not the last.
  std::optional<std::uint32_t> scanned_;
  mutable ChunkCache cache_{[this](std::uint32_t i) { return ReadChunk(i); }};
};

/// The file, if it begins with the magic; InvalidArgument with what it is otherwise.
[[nodiscard]] absl::StatusOr<RandomFile> OpenWithMagic(const std::string& path,
                                                       std::string_view magic,
                                                       std::string_view otherwise);

/// A bag of a kind of ChunkedFile, indexed.
template <typename Kind>
[[nodiscard]] absl::StatusOr<std::unique_ptr<BagFile>> OpenChunked(const std::string& path,
                                                                   std::string_view magic,
                                                                   std::string_view otherwise) {
  ASSIGN_OR_RETURN(RandomFile file, OpenWithMagic(path, magic, otherwise));
  auto bag = std::make_unique<Kind>(std::move(file));
  RETURN_IF_ERROR(bag->Index());
  return bag;
}

}  // namespace scanloc::dataset
