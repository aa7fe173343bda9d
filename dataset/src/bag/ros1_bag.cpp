// ROS 1's bags of version 2.0: http://wiki.ros.org/Bags/Format/2.0.
#include <array>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "bag/chunked_file.hpp"
#include "bag/little_endian.hpp"
#include "decimal_time.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::string_view kRos1Magic = "#ROSBAG V2.0\n";
// Heads and connections are texts; longer ones are none.
constexpr std::uint32_t kMaxHeadBytes = 16 << 20;

enum Op : unsigned char {
  kMessageData = 0x02,
  kIndexData = 0x04,
  kChunkRecord = 0x05,
  kConnection = 0x07,
};

std::int64_t StampOf(LittleEndian& content) {
  const std::int64_t seconds = content.Read<std::uint32_t>();
  return seconds * kNanosecondsPerS + content.Read<std::uint32_t>();
}

// The value of a field of a head, which is a list of "name=value".
std::optional<std::string_view> Field(std::string_view head, std::string_view name) {
  LittleEndian fields(head);
  while (fields.num_left() > 0) {
    const std::string_view field = fields.ReadString();
    if (!fields.ok()) return std::nullopt;
    const std::size_t equals = field.find('=');
    if (equals == name.size() && field.substr(0, equals) == name) return field.substr(equals + 1);
  }
  return std::nullopt;
}

template <typename Number>
std::optional<Number> NumberField(std::string_view head, std::string_view name) {
  const std::optional<std::string_view> value = Field(head, name);
  if (!value || value->size() != sizeof(Number)) return std::nullopt;
  return LittleEndian(*value).Read<Number>();
}

class Ros1Bag : public ChunkedFile {
 public:
  explicit Ros1Bag(RandomFile file) : ChunkedFile(std::move(file)) {}

  absl::Status Index() {
    std::string cut_off;
    std::optional<std::uint32_t> num_chunks_told;
    std::uint32_t num_chunks = 0;
    for (std::uint64_t at = kRos1Magic.size(); at < file().size();) {
      ASSIGN_OR_RETURN(const std::optional<FileRecord> read, ReadRecordAt(at));
      if (!read.has_value() || read->num_data > file().size() - read->data_at) {
        cut_off = absl::StrCat("is cut off, or damaged, at byte ", at, " of ", file().size());
      }
      if (!read.has_value()) break;
      const FileRecord& record = *read;
      if (at == kRos1Magic.size()) {
        // Where the index at the end begins: 0 in a bag that was not closed.
        const auto index_at = NumberField<std::uint64_t>(record.head, "index_pos");
        if (index_at.value_or(0) == 0) cut_off = "was not closed and may be cut off";
        if (index_at.value_or(0) > file().size()) cut_off = "is cut off before its index";
        num_chunks_told = NumberField<std::uint32_t>(record.head, "chunk_count");
      }
      num_chunks += NumberField<unsigned char>(record.head, "op") == kChunkRecord ? 1 : 0;
      RETURN_IF_ERROR(ReadRecord(record));
      at = record.data_at + record.num_data;
    }
    RETURN_IF_ERROR(FinishIndex(cut_off));
    if (cut_off.empty() && num_chunks_told && *num_chunks_told != num_chunks) {
      AddNoteOfFile(absl::StrCat("is damaged: of the ", *num_chunks_told,
                                 " chunks that it tells of there are ", num_chunks));
    }
    return absl::OkStatus();
  }

 protected:
  absl::Status ScanRecords(std::string_view records, bool with_messages) override {
    LittleEndian rest(records);
    while (rest.num_left() > 0) {
      const std::size_t at = records.size() - rest.num_left();
      const std::string_view head = rest.ReadString();
      const std::string_view data = rest.ReadString();
      if (!rest.ok()) {
        return absl::DataLossError(absl::StrCat("the record at ", at, " is not whole"));
      }
      const auto op = NumberField<unsigned char>(head, "op");
      if (op == kConnection) AddConnection(head, data);
      if (op == kMessageData && with_messages) AddMessageData(head, at);
    }
    return absl::OkStatus();
  }
  std::optional<Record> RecordAt(std::string_view records, std::uint64_t at) const override {
    if (at > records.size()) return std::nullopt;
    LittleEndian record(records.substr(at));
    const std::string_view head = record.ReadString();
    const std::string_view data = record.ReadString();
    const auto connection = NumberField<std::uint32_t>(head, "conn");
    const std::string_view time = Field(head, "time").value_or("");
    if (!record.ok() || NumberField<unsigned char>(head, "op") != kMessageData || !connection ||
        time.size() != 8) {
      return std::nullopt;
    }
    LittleEndian stamp(time);
    return Record{*connection, StampOf(stamp), data};
  }

 private:
  // A record of the file: its head, and where its data are.
  struct FileRecord {
    std::uint64_t begin;
    std::string head;
    std::uint64_t data_at;
    std::uint32_t num_data;
  };
  // None where the file ends before the record's data begin, or the head is none.
  [[nodiscard]] absl::StatusOr<std::optional<FileRecord>> ReadRecordAt(std::uint64_t at) const {
    const std::uint64_t size = file().size();
    const auto length_at = [&](std::uint64_t place) -> absl::StatusOr<std::uint32_t> {
      std::array<char, 4> raw{};
      RETURN_IF_ERROR(file().ReadAt(place, raw.size(), raw.data()));
      return LittleEndian({raw.data(), raw.size()}).Read<std::uint32_t>();
    };
    if (size - at < 8) return std::nullopt;
    ASSIGN_OR_RETURN(const std::uint32_t num_head, length_at(at));
    if (num_head > std::min<std::uint64_t>(size - at - 8, kMaxHeadBytes)) return std::nullopt;
    ASSIGN_OR_RETURN(std::string head, file().ReadText(at + 4, num_head));
    const std::uint64_t data_at = at + 8 + num_head;
    ASSIGN_OR_RETURN(const std::uint32_t num_data, length_at(data_at - 4));
    return FileRecord{at, std::move(head), data_at, num_data};
  }
  absl::Status ReadRecord(const FileRecord& record) {
    const auto op = NumberField<unsigned char>(record.head, "op");
    if (op == kChunkRecord) return AddChunkRecord(record);
    if (record.num_data > file().size() - record.data_at) return absl::OkStatus();
    if (op == kMessageData) {
      const std::uint64_t num_record = record.data_at - record.begin + record.num_data;
      RETURN_IF_ERROR(AddChunk({.offset = record.begin,
                                .num_stored = num_record,
                                .num_bytes = num_record,
                                .is_indexed = true}));
      AddMessageData(record.head, 0);
      return absl::OkStatus();
    }
    if (op != kConnection && op != kIndexData) return absl::OkStatus();
    if (op == kConnection && record.num_data > kMaxHeadBytes) return absl::OkStatus();
    ASSIGN_OR_RETURN(const std::string data, file().ReadText(record.data_at, record.num_data));
    if (op == kConnection) {
      AddConnection(record.head, data);
      return absl::OkStatus();
    }
    const auto connection = NumberField<std::uint32_t>(record.head, "conn");
    if (!connection || last_chunk() == nullptr) return absl::OkStatus();
    last_chunk()->is_indexed = true;
    LittleEndian entries(data);
    while (entries.num_left() >= 12) {
      const std::int64_t log_time_ns = StampOf(entries);
      AddMessage(*connection, log_time_ns, entries.Read<std::uint32_t>());
    }
    return absl::OkStatus();
  }
  absl::Status AddChunkRecord(const FileRecord& record) {
    const std::string_view name = Field(record.head, "compression").value_or("");
    const std::optional<Compression> compression = ParseCompression(name);
    const auto num_bytes = NumberField<std::uint32_t>(record.head, "size");
    if (!compression || !num_bytes) {
      return absl::InvalidArgumentError(absl::StrCat(file().path(), ": the chunk at ", record.begin,
                                                     " is damaged, or compressed by ", Quote(name),
                                                     "; none, bz2 and lz4 are read"));
    }
    const std::uint64_t num_stored =
        std::min<std::uint64_t>(record.num_data, file().size() - record.data_at);
    return AddChunk({.offset = record.data_at,
                     .num_stored = num_stored,
                     .num_bytes = *num_bytes,
                     .compression = *compression,
                     .is_cut_off = num_stored < record.num_data});
  }
  void AddConnection(std::string_view head, std::string_view data) {
    const auto connection = NumberField<std::uint32_t>(head, "conn");
    const auto topic = Field(head, "topic");
    const auto type = Field(data, "type");
    if (!connection || !topic || !type) return;
    AddChannel(
        *connection,
        {.name = std::string(*topic), .type = ShortType(*type), .format = WireFormat::kRos1});
  }
  void AddMessageData(std::string_view head, std::uint64_t at) {
    const auto connection = NumberField<std::uint32_t>(head, "conn");
    const std::optional<std::string_view> time = Field(head, "time");
    if (!connection || !time || time->size() != 8) return;
    LittleEndian stamp(*time);
    AddMessage(*connection, StampOf(stamp), at);
  }
};

}  // namespace

absl::StatusOr<std::unique_ptr<BagFile>> OpenRos1Bag(const std::string& path) {
  return OpenChunked<Ros1Bag>(
      path, kRos1Magic,
      "is a bag of ROS 1, but not of version 2.0; `rosbag fix` makes that of "
      "an older one, for a newer one ask for a newer scanloc");
}

}  // namespace scanloc::dataset
