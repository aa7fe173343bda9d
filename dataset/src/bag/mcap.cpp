// MCAP: https://mcap.dev/spec, version 0.
#include <array>
#include <map>
#include <string>

#include "absl/strings/str_cat.h"
#include "bag/chunked_file.hpp"
#include "bag/little_endian.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kRecordHeadBytes = 9;  // opcode and length
constexpr std::size_t kMessageHeadBytes = 22;
constexpr std::size_t kFooterBytes = 20;
// Up to the checksum, which is of all from the summary's begin to here.
constexpr std::size_t kCheckedFooterBytes = kRecordHeadBytes + 16;
// Schemas and channels are texts; longer ones are none.
constexpr std::uint64_t kMaxTextBytes = 16 << 20;

enum Opcode : unsigned char {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};

class Mcap : public ChunkedFile {
 public:
  explicit Mcap(RandomFile file) : ChunkedFile(std::move(file)) {}

  absl::Status Index() {
    ASSIGN_OR_RETURN(const std::string cut_off, ReadDataSection());
    RETURN_IF_ERROR(CheckDataSection());
    RETURN_IF_ERROR(FinishIndex(cut_off));
    if (num_messages_told_ && *num_messages_told_ != messages_.size()) {
      AddNoteOfFile(absl::StrCat("is damaged: of the ", *num_messages_told_,
                                 " messages that it tells of there are ", messages_.size()));
    }
    return absl::OkStatus();
  }

 protected:
  absl::Status ScanRecords(std::string_view records, bool with_messages) override {
    for (std::size_t at = 0; at < records.size();) {
      LittleEndian head(records.substr(at));
      const auto opcode = head.Read<unsigned char>();
      const auto num_bytes = head.Read<std::uint64_t>();
      if (!head.ok() || num_bytes > head.num_left()) {
        return absl::DataLossError(absl::StrCat("the record at ", at, " is not whole"));
      }
      LittleEndian content(records.substr(at + kRecordHeadBytes, num_bytes));
      if (opcode == kSchema || opcode == kChannel) ReadSchemaOrChannel(opcode, content);
      if (opcode == kStatistics && num_bytes >= 8)
        num_messages_told_ = content.Read<std::uint64_t>();
      if (opcode == kMessage && with_messages && num_bytes >= kMessageHeadBytes) {
        const auto channel = content.Read<std::uint16_t>();
        content.Skip(4);  // sequence
        AddMessage(channel, static_cast<std::int64_t>(content.Read<std::uint64_t>()), at);
      }
      at += kRecordHeadBytes + num_bytes;
    }
    return absl::OkStatus();
  }
  std::optional<Record> RecordAt(std::string_view records, std::uint64_t at) const override {
    if (at > records.size()) return std::nullopt;
    LittleEndian head(records.substr(at));
    const auto opcode = head.Read<unsigned char>();
    const auto num_bytes = head.Read<std::uint64_t>();
    if (!head.ok() || opcode != kMessage || num_bytes < kMessageHeadBytes ||
        num_bytes > head.num_left()) {
      return std::nullopt;
    }
    const auto channel = head.Read<std::uint16_t>();
    head.Skip(4);  // sequence
    return Record{
        channel, static_cast<std::int64_t>(head.Read<std::uint64_t>()),
        records.substr(at + kRecordHeadBytes + kMessageHeadBytes, num_bytes - kMessageHeadBytes)};
  }

 private:
  // Reads up to the record DataEnd. How the file is cut off, if it is.
  absl::StatusOr<std::string> ReadDataSection() {
    std::uint64_t at = kMagic.size();
    while (at + kRecordHeadBytes <= file().size()) {
      std::array<char, kRecordHeadBytes> raw{};
      RETURN_IF_ERROR(file().ReadAt(at, raw.size(), raw.data()));
      LittleEndian head({raw.data(), raw.size()});
      const auto opcode = head.Read<unsigned char>();
      const auto num_bytes = head.Read<std::uint64_t>();
      const std::uint64_t num_left = file().size() - at - kRecordHeadBytes;
      if (opcode == kFooter) return "";
      // Of what is cut off only a chunk is worth reading.
      if (num_bytes <= num_left || opcode == kChunk) {
        const std::uint64_t num_there = std::min(num_bytes, num_left);
        RETURN_IF_ERROR(opcode == kDataEnd ? ReadDataEnd(at + kRecordHeadBytes, num_there)
                                           : ReadRecord(opcode, at + kRecordHeadBytes, num_there));
        if (opcode == kDataEnd) return "";
      }
      if (num_bytes > num_left) break;
      at += kRecordHeadBytes + num_bytes;
    }
    return absl::StrCat("is cut off, or damaged, at byte ", at, " of ", file().size());
  }
  absl::Status ReadDataEnd(std::uint64_t at, std::uint64_t num_bytes) {
    data_end_ = at - kRecordHeadBytes;
    std::array<char, 4> raw{};
    if (num_bytes < raw.size()) return absl::OkStatus();
    RETURN_IF_ERROR(file().ReadAt(at, raw.size(), raw.data()));
    data_checksum_ = LittleEndian({raw.data(), raw.size()}).Read<std::uint32_t>();
    return ReadSummary(at + num_bytes);
  }
  // What stands once more at the end of a file: topics, and how many messages there are.
  absl::Status ReadSummary(std::uint64_t begin) {
    constexpr std::size_t kEndBytes = kRecordHeadBytes + kFooterBytes + kMagic.size();
    constexpr std::string_view kNotUsed =
        "has a damaged end: the summary there is not used, topics are those told before";
    const std::uint64_t num_bytes = file().size() - begin;
    if (num_bytes < kEndBytes || num_bytes > limits::kMaxBagChunkBytes) {
      AddNoteOfFile(kNotUsed);
      return absl::OkStatus();
    }
    ASSIGN_OR_RETURN(const std::string bytes, file().ReadText(begin, num_bytes));
    const std::string_view summary = std::string_view(bytes).substr(0, num_bytes - kEndBytes);
    LittleEndian footer(std::string_view(bytes).substr(summary.size()));
    bool is_whole = footer.Read<unsigned char>() == kFooter;
    is_whole &= footer.Read<std::uint64_t>() == kFooterBytes;
    footer.Skip(kFooterBytes - 4);
    const auto checksum = footer.Read<std::uint32_t>();
    is_whole &= std::string_view(bytes).substr(bytes.size() - kMagic.size()) == kMagic;
    is_whole &= checksum == 0 || checksum == Crc32(std::string_view(bytes).substr(
                                                 0, summary.size() + kCheckedFooterBytes));
    if (!is_whole || !ScanRecords(summary, false).ok()) AddNoteOfFile(kNotUsed);
    return absl::OkStatus();
  }
  // Chunks have checksums of their own, and who has only this one cannot be told what is damaged.
  absl::Status CheckDataSection() const {
    if (data_checksum_ == 0 || !HasUncheckedMessages()) return absl::OkStatus();
    const absl::StatusOr<std::uint32_t> checksum = file().ChecksumOf(0, data_end_);
    if (!checksum.ok() || *checksum == data_checksum_) return checksum.status();
    return absl::DataLossError(
        absl::StrCat(file().path(),
                     ": is damaged: the checksum of its data is not the one told, and its messages "
                     "have none; take another copy, or keep what `mcap recover` saves of it"));
  }
  // num_bytes are what the file holds of the record.
  absl::Status ReadRecord(unsigned char opcode, std::uint64_t at, std::uint64_t num_bytes) {
    if (opcode == kChunk) return ReadChunkHead(at, num_bytes);
    if (opcode == kMessage) {
      // With its head, as it would stand in a chunk.
      const std::uint64_t num_record = num_bytes + kRecordHeadBytes;
      RETURN_IF_ERROR(AddChunk({.offset = at - kRecordHeadBytes,
                                .num_stored = num_record,
                                .num_bytes = num_record,
                                .is_indexed = true}));
      std::array<char, kMessageHeadBytes> head{};
      if (num_bytes < head.size()) return absl::OkStatus();
      RETURN_IF_ERROR(file().ReadAt(at, head.size(), head.data()));
      LittleEndian content({head.data(), head.size()});
      const auto channel = content.Read<std::uint16_t>();
      content.Skip(4);  // sequence
      AddMessage(channel, static_cast<std::int64_t>(content.Read<std::uint64_t>()), 0);
      return absl::OkStatus();
    }
    const bool is_text = opcode == kSchema || opcode == kChannel;
    if (!is_text && opcode != kMessageIndex) return absl::OkStatus();
    if (is_text && num_bytes > kMaxTextBytes) return absl::OkStatus();
    ASSIGN_OR_RETURN(const std::string content, file().ReadText(at, num_bytes));
    is_text ? ReadSchemaOrChannel(opcode, LittleEndian(content))
            : ReadMessageIndex(LittleEndian(content));
    return absl::OkStatus();
  }
  absl::Status ReadChunkHead(std::uint64_t at, std::uint64_t num_bytes) {
    std::string head(std::min<std::uint64_t>(num_bytes, 128), '\0');
    RETURN_IF_ERROR(file().ReadAt(at, head.size(), head.data()));
    LittleEndian content(head);
    content.Skip(16);  // the times of its first and last message
    Chunk chunk{.num_bytes = content.Read<std::uint64_t>()};
    chunk.checksum = content.Read<std::uint32_t>();
    const std::string_view name = content.ReadString();
    const auto num_stored = content.Read<std::uint64_t>();
    const std::size_t num_head = head.size() - content.num_left();
    if (!content.ok()) {
      if (at + num_bytes == file().size()) return absl::OkStatus();  // cut off within
      return absl::InvalidArgumentError(
          absl::StrCat(file().path(), ": the head of the chunk at ", at, " is damaged"));
    }
    const std::optional<Compression> compression = ParseCompression(name);
    if (!compression) {
      return absl::InvalidArgumentError(absl::StrCat(file().path(), ": a chunk is compressed by ",
                                                     Quote(name), "; none, zstd and lz4 are read"));
    }
    chunk.compression = *compression;
    chunk.offset = at + num_head;
    chunk.num_stored = std::min(num_stored, num_bytes - num_head);
    chunk.is_cut_off = chunk.num_stored < num_stored && at + num_bytes == file().size();
    return AddChunk(chunk);
  }
  void ReadMessageIndex(LittleEndian content) {
    const auto channel = content.Read<std::uint16_t>();
    content.Skip(4);  // bytes of the entries
    if (last_chunk() == nullptr) return;
    last_chunk()->is_indexed = true;
    while (content.num_left() >= 16) {
      const auto log_time_ns = content.Read<std::uint64_t>();
      AddMessage(channel, static_cast<std::int64_t>(log_time_ns), content.Read<std::uint64_t>());
    }
  }
  void ReadSchemaOrChannel(unsigned char opcode, LittleEndian content) {
    const auto id = content.Read<std::uint16_t>();
    if (opcode == kSchema) {
      const std::string_view name = content.ReadString();
      if (content.ok()) schemas_[id] = std::string(name);
      return;
    }
    const auto schema = schemas_.find(content.Read<std::uint16_t>());
    const std::string_view topic = content.ReadString();
    const std::string_view encoding = content.ReadString();
    if (!content.ok()) return;
    AddChannel(id, {.name = std::string(topic),
                    .type = schema == schemas_.end() ? "" : ShortType(schema->second),
                    .format = encoding == "cdr"    ? WireFormat::kCdr
                              : encoding == "ros1" ? WireFormat::kRos1
                                                   : WireFormat::kOther});
  }

  std::map<std::uint16_t, std::string> schemas_;
  std::uint64_t data_end_ = 0;       ///< where the record DataEnd begins; 0: there is none
  std::uint32_t data_checksum_ = 0;  ///< of all before it; 0: not told
  std::optional<std::uint64_t> num_messages_told_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<BagFile>> OpenMcap(const std::string& path) {
  return OpenChunked<Mcap>(path, kMagic,
                           "is not MCAP of version 0; convert it, or ask for a newer scanloc");
}

}  // namespace scanloc::dataset
