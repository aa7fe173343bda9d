// MCAP: https://mcap.dev/spec, version 0.
#include <array>
#include <map>
#include <string>

#include "absl/strings/str_cat.h"
#include "bag/chunked_file.hpp"
#include "bag/little_endian.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kRecordHeadBytes = 9;  // opcode and length
constexpr std::size_t kMessageHeadBytes = 22;
// Schemas and channels are texts; longer ones are none.
constexpr std::uint64_t kMaxTextBytes = 16 << 20;

enum Opcode : unsigned char {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
};

class Mcap : public ChunkedFile {
 public:
  explicit Mcap(RandomFile file) : ChunkedFile(std::move(file)) {}

  absl::Status Index();

 protected:
  absl::Status ScanRecords(std::string_view records, bool with_messages) override;
  absl::StatusOr<std::string_view> PayloadAt(std::string_view records,
                                             std::uint64_t at) const override;

 private:
  absl::Status ReadRecord(unsigned char opcode, std::uint64_t at, std::uint64_t num_bytes);
  absl::Status ReadChunkHead(std::uint64_t at, std::uint64_t num_bytes);
  void ReadMessageIndex(LittleEndian content);
  void ReadSchemaOrChannel(unsigned char opcode, LittleEndian content);

  std::map<std::uint16_t, std::string> schemas_;
};

void Mcap::ReadSchemaOrChannel(unsigned char opcode, LittleEndian content) {
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

absl::Status Mcap::ReadChunkHead(std::uint64_t at, std::uint64_t num_bytes) {
  std::string head(std::min<std::uint64_t>(num_bytes, 128), '\0');
  if (absl::Status status = file().ReadAt(at, head.size(), head.data()); !status.ok()) {
    return status;
  }
  LittleEndian content(head);
  content.Skip(16);  // the times of its first and last message
  Chunk chunk{.num_bytes = content.Read<std::uint64_t>()};
  content.Skip(4);  // checksum
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
  chunk.is_cut_off = chunk.num_stored < num_stored;
  return AddChunk(chunk);
}

void Mcap::ReadMessageIndex(LittleEndian content) {
  const auto channel = content.Read<std::uint16_t>();
  content.Skip(4);  // bytes of the entries
  if (last_chunk() == nullptr) return;
  last_chunk()->is_indexed = true;
  while (content.num_left() >= 16) {
    const auto log_time_ns = content.Read<std::uint64_t>();
    AddMessage(channel, static_cast<std::int64_t>(log_time_ns), content.Read<std::uint64_t>());
  }
}

// num_bytes are what the file holds of the record.
absl::Status Mcap::ReadRecord(unsigned char opcode, std::uint64_t at, std::uint64_t num_bytes) {
  if (opcode == kChunk) return ReadChunkHead(at, num_bytes);
  if (opcode == kMessage) {
    // With its head, as it would stand in a chunk.
    const std::uint64_t num_record = num_bytes + kRecordHeadBytes;
    if (absl::Status status = AddChunk({.offset = at - kRecordHeadBytes,
                                        .num_stored = num_record,
                                        .num_bytes = num_record,
                                        .is_indexed = true});
        !status.ok()) {
      return status;
    }
    std::array<char, kMessageHeadBytes> head{};
    if (num_bytes < head.size()) return absl::OkStatus();
    if (absl::Status s = file().ReadAt(at, head.size(), head.data()); !s.ok()) return s;
    LittleEndian content({head.data(), head.size()});
    const auto channel = content.Read<std::uint16_t>();
    content.Skip(4);  // sequence
    AddMessage(channel, static_cast<std::int64_t>(content.Read<std::uint64_t>()), 0);
    return absl::OkStatus();
  }
  const bool is_text = opcode == kSchema || opcode == kChannel;
  if (!is_text && opcode != kMessageIndex) return absl::OkStatus();
  if (is_text && num_bytes > kMaxTextBytes) return absl::OkStatus();
  const absl::StatusOr<std::string> content = file().ReadText(at, num_bytes);
  if (!content.ok()) return content.status();
  is_text ? ReadSchemaOrChannel(opcode, LittleEndian(*content))
          : ReadMessageIndex(LittleEndian(*content));
  return absl::OkStatus();
}

absl::Status Mcap::Index() {
  bool is_cut_off = true;
  for (std::uint64_t at = kMagic.size(); at + kRecordHeadBytes <= file().size();) {
    std::array<char, kRecordHeadBytes> raw{};
    if (absl::Status s = file().ReadAt(at, raw.size(), raw.data()); !s.ok()) return s;
    LittleEndian head({raw.data(), raw.size()});
    const auto opcode = head.Read<unsigned char>();
    const auto num_bytes = head.Read<std::uint64_t>();
    at += kRecordHeadBytes;
    if (opcode == kFooter) {
      is_cut_off = false;
      break;
    }
    const std::uint64_t num_left = file().size() - at;
    // Of what is cut off only a chunk is worth reading.
    if (num_bytes <= num_left || opcode == kChunk) {
      if (absl::Status s = ReadRecord(opcode, at, std::min(num_bytes, num_left)); !s.ok()) return s;
    }
    if (num_bytes > num_left) break;
    at += num_bytes;
  }
  return FinishIndex(is_cut_off);
}

absl::Status Mcap::ScanRecords(std::string_view records, bool with_messages) {
  for (std::size_t at = 0; at < records.size();) {
    LittleEndian head(records.substr(at));
    const auto opcode = head.Read<unsigned char>();
    const auto num_bytes = head.Read<std::uint64_t>();
    if (!head.ok() || num_bytes > head.num_left()) {
      return absl::InvalidArgumentError(absl::StrCat("the record at ", at, " is not whole"));
    }
    LittleEndian content(records.substr(at + kRecordHeadBytes, num_bytes));
    if (opcode == kSchema || opcode == kChannel) ReadSchemaOrChannel(opcode, content);
    if (opcode == kMessage && with_messages && num_bytes >= kMessageHeadBytes) {
      const auto channel = content.Read<std::uint16_t>();
      content.Skip(4);  // sequence
      AddMessage(channel, static_cast<std::int64_t>(content.Read<std::uint64_t>()), at);
    }
    at += kRecordHeadBytes + num_bytes;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string_view> Mcap::PayloadAt(std::string_view records, std::uint64_t at) const {
  if (at <= records.size()) {
    LittleEndian head(records.substr(at));
    const auto opcode = head.Read<unsigned char>();
    const auto num_bytes = head.Read<std::uint64_t>();
    if (head.ok() && opcode == kMessage && num_bytes >= kMessageHeadBytes &&
        num_bytes <= head.num_left()) {
      return records.substr(at + kRecordHeadBytes + kMessageHeadBytes,
                            num_bytes - kMessageHeadBytes);
    }
  }
  return absl::InvalidArgumentError("there is no whole message; the index of the file is damaged");
}

}  // namespace

absl::StatusOr<std::unique_ptr<BagFile>> OpenMcap(const std::string& path) {
  return OpenChunked<Mcap>(path, kMagic,
                           "is not MCAP of version 0; convert it, or ask for a newer scanloc");
}

}  // namespace scanloc::dataset
