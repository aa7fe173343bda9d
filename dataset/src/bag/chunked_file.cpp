#include "bag/chunked_file.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <new>
#include <thread>

#include "absl/strings/str_cat.h"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

bool IsBefore(const MessageRef& a, const MessageRef& b) {
  return std::pair(a.chunk, a.at) < std::pair(b.chunk, b.at);
}

/// The first message from `at` on of the same topic in another chunk; the end where it is far.
template <typename Iterator>
Iterator FindElsewhere(Iterator at, Iterator end, const MessageRef& message) {
  constexpr int kMostMessages = 4096;
  for (int i = 0; i < kMostMessages && at != end; ++i, ++at) {
    if (at->topic == message.topic && at->chunk != message.chunk) return at;
  }
  return end;
}

}  // namespace

absl::Status ChunkedFile::AddChunk(const Chunk& chunk) {
  if (chunk.num_bytes > limits::kMaxBagChunkBytes || chunk.num_stored > limits::kMaxBagChunkBytes) {
    return absl::InvalidArgumentError(absl::StrCat(
        file_.path(), ": a chunk announces ", std::max(chunk.num_bytes, chunk.num_stored),
        " bytes; at most ", limits::kMaxBagChunkBytes, " are read"));
  }
  if (chunks_.size() >= std::numeric_limits<std::uint32_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat(file_.path(), ": has too many chunks"));
  }
  chunks_.push_back(chunk);
  const bool is_told = chunk.checksum != 0 && !chunk.is_cut_off;
  checked_.emplace_back(is_told ? Checked::kNotYet : Checked::kRight);
  return absl::OkStatus();
}

void ChunkedFile::AddMessage(std::uint32_t channel, std::int64_t log_time_ns, std::uint64_t at) {
  const auto last = static_cast<std::uint32_t>(chunks_.size() - 1);
  messages_.push_back({log_time_ns, channel, scanned_.value_or(last), at});
}

absl::StatusOr<FileBytes> ChunkedFile::ReadStored(std::uint64_t offset,
                                                  std::uint64_t num_bytes) const try {
  ByteArray stored = memory_->Take(num_bytes);
  RETURN_IF_ERROR(file_.ReadAt(offset, num_bytes, stored.get()));
  return FileBytes(std::move(stored), num_bytes);
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(
      absl::StrCat(file_.path(), ": no memory for ", num_bytes, " bytes"));
}

absl::Status ChunkedFile::Check(std::uint32_t i, std::uint32_t checksum) const {
  checked_[i] = checksum == chunks_[i].checksum ? Checked::kRight : Checked::kDamaged;
  return StatusOf(i);
}

absl::Status ChunkedFile::StatusOf(std::uint32_t i) const {
  if (checked_[i] != Checked::kDamaged) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat(file_.path(), ": chunk at ", chunks_[i].offset,
                   ": its bytes are damaged: their checksum is not the one told"));
}

absl::Status ChunkedFile::CheckStored(std::uint32_t i) const {
  if (checked_[i] != Checked::kNotYet) return StatusOf(i);
  const Chunk& chunk = chunks_[i];
  const absl::StatusOr<std::uint32_t> checksum =
      file_.ChecksumOf(chunk.offset, chunk.offset + chunk.num_stored);
  return checksum.ok() ? Check(i, *checksum) : checksum.status();
}

absl::StatusOr<FileBytes> ChunkedFile::ReadChunk(std::uint32_t i) const {
  const Chunk& chunk = chunks_[i];
  absl::StatusOr<FileBytes> records = ReadStored(chunk.offset, chunk.num_stored);
  if (records.ok() && chunk.compression != Compression::kNone) {
    records = Decompress(chunk.compression, records->view(), chunk.num_bytes,
                         chunk.is_cut_off ? CutOff::kKeepWhatCame : CutOff::kRefuse, memory_.get());
  }
  if (!records.ok()) {
    return Annotate(records.status(), absl::StrCat(file_.path(), ": chunk at ", chunk.offset));
  }
  if (checked_[i] != Checked::kRight) {
    RETURN_IF_ERROR(Check(i, Crc32(records->view())));
  }
  return records;
}

void ChunkedFile::ReadAhead(const MessageRef& message) const {
  // A chunk ahead for each other processor; more would but fill memory.
  const std::size_t num_ahead =
      std::clamp<std::size_t>(std::thread::hardware_concurrency(), 2, 4) - 1;
  auto next = std::lower_bound(messages_.begin(), messages_.end(), message, IsBefore);
  const auto before = FindElsewhere(std::make_reverse_iterator(next), messages_.rend(), message);
  // Who leaves chunks out would not want the next.
  if (before == messages_.rend() || !cache_.WasGot(before->chunk)) return;
  for (std::size_t i = 0; i < num_ahead; ++i) {
    next = FindElsewhere(next, messages_.end(), *next);
    if (next == messages_.end()) return;
    cache_.ReadAhead(next->chunk, chunks_[next->chunk].num_bytes);
  }
}

absl::StatusOr<std::string_view> ChunkedFile::Payload(const FileBytes& records, std::uint64_t at,
                                                      const MessageRef& message) const {
  const std::optional<Record> record = RecordAt(records.view(), at);
  if (record && record->channel == channel_of_[message.topic] &&
      record->log_time_ns == message.log_time_ns) {
    return record->payload;
  }
  return absl::DataLossError(absl::StrCat(file_.path(), ": chunk at ",
                                          chunks_[message.chunk].offset, ": there is no ",
                                          record ? "such" : "whole", " message at ", message.at,
                                          "; the index is damaged, or the bytes"));
}

absl::StatusOr<MessageBytes> ChunkedFile::ReadStoredMessage(const MessageRef& message) const {
  // An index of a damaged file may say of small records that they lie far apart.
  constexpr std::uint64_t kSmall = 64 << 10;
  const Chunk& chunk = chunks_[message.chunk];
  const auto next = std::upper_bound(messages_.begin(), messages_.end(), message, IsBefore);
  const bool is_last = next == messages_.end() || next->chunk != message.chunk;
  const std::uint64_t end = is_last ? chunk.num_stored : std::min(next->at, chunk.num_stored);
  const std::uint64_t begin = std::min(message.at, end);
  for (std::uint64_t num_bytes = std::min(end - begin, kSmall);; num_bytes = end - begin) {
    ASSIGN_OR_RETURN(FileBytes read, ReadStored(chunk.offset + begin, num_bytes));
    const absl::StatusOr<std::string_view> payload = Payload(read, 0, message);
    if (payload.ok()) {
      return MessageBytes{std::make_shared<const FileBytes>(std::move(read)), *payload};
    }
    if (num_bytes == end - begin) return payload.status();
  }
}

absl::StatusOr<MessageBytes> ChunkedFile::Read(const MessageRef& message) const {
  const Chunk& chunk = chunks_[message.chunk];
  if (chunk.compression == Compression::kNone) {
    RETURN_IF_ERROR(CheckStored(message.chunk));
    return ReadStoredMessage(message);
  }
  if (!cache_.WasGot(message.chunk)) ReadAhead(message);
  ASSIGN_OR_RETURN(ChunkCache::Records records, cache_.Get(message.chunk, chunk.num_bytes));
  ASSIGN_OR_RETURN(const std::string_view payload, Payload(*records, message.at, message));
  return MessageBytes{std::move(records), payload};
}

void ChunkedFile::AddNoteOfFile(std::string_view note) {
  notes_.push_back(absl::StrCat(file_.path(), " ", ToAbsl(note)));
}

bool ChunkedFile::HasUncheckedMessages() const {
  return std::ranges::any_of(
      messages_, [&](const MessageRef& message) { return chunks_[message.chunk].checksum == 0; });
}

absl::Status ChunkedFile::ScanChunk(std::uint32_t i, bool with_messages) {
  const absl::StatusOr<FileBytes> records = ReadChunk(i);
  if (absl::IsDataLoss(records.status())) {
    notes_.push_back(absl::StrCat(records.status().message(), "; its messages are left out"));
    return absl::OkStatus();
  }
  if (!records.ok()) return records.status();
  scanned_ = i;
  const absl::Status status = ScanRecords(records->view(), with_messages);
  scanned_.reset();
  if (status.ok() || chunks_[i].is_cut_off) return absl::OkStatus();
  if (!absl::IsDataLoss(status)) return status;
  notes_.push_back(absl::StrCat(file_.path(), ": chunk at ", chunks_[i].offset, ": ",
                                status.message(), "; what comes before is read"));
  return absl::OkStatus();
}

// Topics count by their order in the map.
void ChunkedFile::MakeTopics() {
  std::map<std::uint32_t, std::uint32_t> topic_of;
  for (const auto& [channel, topic] : channels_) {
    topic_of.emplace(channel, static_cast<std::uint32_t>(topics_.size()));
    topics_.push_back(topic);
    channel_of_.push_back(channel);
  }
  const std::size_t num_nameless = std::erase_if(messages_, [&](MessageRef& message) {
    const auto topic = topic_of.find(message.topic);
    if (topic != topic_of.end()) message.topic = topic->second;
    return topic == topic_of.end();
  });
  if (num_nameless > 0) {
    AddNoteOfFile(absl::StrCat("is damaged: of ", num_nameless,
                               " messages it does not name the topic; they are left out"));
  }
}

absl::Status ChunkedFile::FinishIndex(std::string_view cut_off) {
  if (!cut_off.empty()) {
    AddNoteOfFile(absl::StrCat(ToAbsl(cut_off), "; what comes before is read"));
    const auto last = static_cast<std::uint32_t>(chunks_.size() - 1);
    if (!chunks_.empty() && chunks_[last].is_indexed) {
      chunks_[last].is_indexed = false;
      std::erase_if(messages_, [&](const MessageRef& message) { return message.chunk == last; });
    }
  }
  for (std::uint32_t i = 0; i < chunks_.size(); ++i) {
    if (chunks_[i].is_indexed) continue;
    RETURN_IF_ERROR(ScanChunk(i, true));
  }
  // Channels stand in chunks, and once more at the end of a file that is whole.
  std::uint32_t last_scanned = std::numeric_limits<std::uint32_t>::max();
  for (const MessageRef& message : messages_) {
    if (channels_.contains(message.topic) || message.chunk == last_scanned) continue;
    last_scanned = message.chunk;
    RETURN_IF_ERROR(ScanChunk(message.chunk, false));
  }
  MakeTopics();
  std::ranges::stable_sort(messages_, IsBefore);
  return absl::OkStatus();
}

absl::StatusOr<RandomFile> OpenWithMagic(const std::string& path, std::string_view magic,
                                         std::string_view otherwise) {
  ASSIGN_OR_RETURN(RandomFile file, RandomFile::Open(path));
  ASSIGN_OR_RETURN(const std::string begin,
                   file.ReadText(0, std::min<std::uint64_t>(magic.size(), file.size())));
  if (begin != magic) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", ToAbsl(otherwise)));
  }
  return file;
}

}  // namespace scanloc::dataset
