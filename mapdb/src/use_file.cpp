#include "scanloc/mapdb/use_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <string_view>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "checksum.hpp"
#include "folder.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"

namespace scanloc::mapdb {
namespace {

constexpr absl::string_view kUseFileMagic = "scanloc-map-health ";
constexpr int kVersion = 1;
constexpr std::size_t kMaxContentIdBytes = 128;
/// Each line has less; there is at most one for each of a map's places, beside these.
constexpr std::int64_t kMaxLineBytes = 256;
constexpr std::int64_t kMaxOtherLines = 4;

std::string ChecksumOf(absl::string_view text) {
  return absl::StrFormat("%016x",
                         static_cast<std::uint64_t>(
                             Hasher().Add(std::string_view(text.data(), text.size())).Digest64()));
}

absl::Status Damaged(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("it is damaged: ", what));
}

/// Takes number after number out of a line; not ok() once one was none.
class Numbers {
 public:
  explicit Numbers(absl::string_view line) : words_(absl::StrSplit(line, ' ')) {}

  template <typename Int>
  void Take(Int& value) {
    is_ok_ = is_ok_ && next_ < words_.size() && absl::SimpleAtoi(words_[next_], &value);
    ++next_;
  }
  void Take(double& value) {
    is_ok_ = is_ok_ && next_ < words_.size() && absl::SimpleAtod(words_[next_], &value);
    ++next_;
  }
  [[nodiscard]] bool AreAll() const { return is_ok_ && next_ == words_.size(); }

 private:
  const std::vector<absl::string_view> words_;
  std::size_t next_ = 0;
  bool is_ok_ = true;
};

bool TakeTotals(absl::string_view line, MapUse& use) {
  Numbers numbers(line);
  for (std::int64_t* value :
       {&use.since_ns, &use.until_ns, &use.num_localized, &use.num_ambiguous,
        &use.num_not_recognized, &use.num_insufficient, &use.num_refused_nowhere}) {
    numbers.Take(*value);
  }
  return numbers.AreAll();
}

bool TakePlace(absl::string_view line, MapUse& use) {
  std::int32_t place = 0;
  PlaceUse of_place;
  Numbers numbers(line);
  numbers.Take(place);
  numbers.Take(of_place.num_found);
  numbers.Take(of_place.num_refused);
  numbers.Take(of_place.confidence);
  numbers.Take(of_place.disagreement);
  numbers.Take(of_place.recent_disagreement);
  numbers.Take(of_place.last_found_ns);
  numbers.Take(of_place.last_refused_ns);
  return numbers.AreAll() && use.places.emplace(place, of_place).second;
}

}  // namespace

std::string UseFileOf(const std::string& map_path) { return absl::StrCat(map_path, ".health"); }

std::string EncodeUse(const MapUse& use) {
  std::string text = absl::StrCat(kUseFileMagic, kVersion, "\n", use.content_id, "\n");
  absl::StrAppend(&text, use.since_ns, " ", use.until_ns, " ", use.num_localized, " ",
                  use.num_ambiguous, " ", use.num_not_recognized, " ", use.num_insufficient, " ",
                  use.num_refused_nowhere, "\n");
  for (const auto& [place, of_place] : use.places) {
    absl::StrAppendFormat(&text, "%d %d %d %.17g %.17g %.17g %d %d\n", place, of_place.num_found,
                          of_place.num_refused, of_place.confidence, of_place.disagreement,
                          of_place.recent_disagreement, of_place.last_found_ns,
                          of_place.last_refused_ns);
  }
  absl::StrAppend(&text, "checksum ", ChecksumOf(text), "\n");
  return text;
}

absl::StatusOr<MapUse> DecodeUse(const std::string& text) {
  std::vector<absl::string_view> lines = absl::StrSplit(text, '\n');
  if (!absl::ConsumePrefix(&lines.front(), kUseFileMagic)) {
    return absl::InvalidArgumentError("it does not tell how a map fared");
  }
  int version = 0;
  if (!absl::SimpleAtoi(lines.front(), &version)) return Damaged("no version");
  if (version > kVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat("it has version ", version, ", and this program reads ", kVersion));
  }
  constexpr std::size_t kNumFixed = 5;  // magic, content id, totals, checksum, the end
  if (lines.size() < kNumFixed || !lines.back().empty()) return Damaged("it is cut off");
  absl::string_view checksum = lines[lines.size() - 2];
  const absl::string_view before =
      absl::string_view(text).substr(0, text.size() - checksum.size() - 1);
  if (!absl::ConsumePrefix(&checksum, "checksum ") || checksum != ChecksumOf(before)) {
    return Damaged("its checksum does not match");
  }
  MapUse use;
  use.content_id = std::string(lines[1]);
  if (use.content_id.size() > kMaxContentIdBytes) return Damaged("line 2");
  if (!TakeTotals(lines[2], use)) return Damaged("line 3");
  for (std::size_t i = 3; i + 2 < lines.size(); ++i) {
    if (!TakePlace(lines[i], use)) return Damaged(absl::StrCat("line ", i + 1));
  }
  if (auto status = Validate(use); !status.ok()) return Damaged(status.message());
  return use;
}

absl::StatusOr<MapUse> ReadUse(const std::string& path, std::int64_t num_places) {
  ASSIGN_OR_RETURN(const std::string text,
                   ReadFile(path, kMaxLineBytes * (kMaxOtherLines + num_places)));
  absl::StatusOr<MapUse> use = DecodeUse(text);
  if (use.ok() && !use->places.empty() && use->places.rbegin()->first >= num_places) {
    use = Damaged(absl::StrCat("it tells of place ", use->places.rbegin()->first,
                               ", and the map has ", num_places));
  }
  if (use.ok()) return use;
  return absl::Status(use.status().code(), absl::StrCat("'", path, "': ", use.status().message()));
}

absl::Status WriteUse(const std::string& path, const MapUse& use) {
  const std::string part = absl::StrCat(path, ".part");
  const FileDescriptor file(
      open(part.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NONBLOCK, 0666));
  absl::Status status;
  if (file.get() < 0 || !WriteAll(file, EncodeUse(use)) || fsync(file.get()) != 0) {
    status = absl::ErrnoToStatus(errno, absl::StrCat("cannot write '", part, "'"));
  }
  if (status.ok()) status = RenameFile(part, path);
  if (!status.ok()) unlink(part.c_str());
  return status;
}

}  // namespace scanloc::mapdb
