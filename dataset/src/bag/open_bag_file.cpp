#include <fcntl.h>
#include <unistd.h>
#include <zstd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "bag/bag_file.hpp"
#include "bag/decompress.hpp"
#include "bag/random_file.hpp"
#include "file_bytes.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

struct Kind {
  std::string_view magic;  ///< without the version
  absl::StatusOr<std::unique_ptr<BagFile>> (*open)(const std::string& path);
};
constexpr std::array<Kind, 3> kKinds = {
    {{"\x89MCAP", &OpenMcap}, {"#ROSBAG V", &OpenRos1Bag}, {"SQLite format 3", &OpenRos2Database}}};

/// A file that is gone when its holder is; who has it open by then can still read it.
class TemporaryFile {
 public:
  static absl::StatusOr<std::unique_ptr<TemporaryFile>> Make() {
    std::error_code error;
    const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
    if (error) {
      return absl::ErrnoToStatus(error.value(), "there is no folder for temporary files (TMPDIR)");
    }
    std::string path = (folder / "scanloc-bag-XXXXXX").string();
    const int fd = mkostemp(path.data(), O_CLOEXEC);
    if (fd < 0) return absl::ErrnoToStatus(errno, absl::StrCat(path, ": cannot be made"));
    return std::make_unique<TemporaryFile>(fd, path);
  }
  TemporaryFile(int fd, std::string path) : file_(fd), path_(std::move(path)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { unlink(path_.c_str()); }

  [[nodiscard]] const std::string& path() const { return path_; }

  [[nodiscard]] absl::Status Write(std::string_view bytes) const {
    return WriteAll(file_, bytes) ? absl::OkStatus() : absl::ErrnoToStatus(errno, path_);
  }

 private:
  FileDescriptor file_;
  std::string path_;
};

// A whole file that rosbag2 compressed. Of one that is cut off or damaged, what comes before.
absl::StatusOr<std::unique_ptr<BagFile>> OpenCompressed(const RandomFile& file) try {
  ASSIGN_OR_RETURN(const std::unique_ptr<TemporaryFile> plain, TemporaryFile::Make());
  struct Free {
    void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
  };
  const std::unique_ptr<ZSTD_DStream, Free> stream(ZSTD_createDStream());
  if (stream == nullptr) throw std::bad_alloc();
  std::string in(ZSTD_DStreamInSize(), '\0');
  std::string out(ZSTD_DStreamOutSize(), '\0');
  std::uint64_t num_out = 0;
  bool is_damaged = false;
  std::size_t hint = 0;  // 0 after a whole frame
  for (std::uint64_t at = 0; at < file.size() && !is_damaged;) {
    const std::size_t num_in = std::min<std::uint64_t>(in.size(), file.size() - at);
    RETURN_IF_ERROR(file.ReadAt(at, num_in, in.data()));
    at += num_in;
    ZSTD_inBuffer input{in.data(), num_in, 0};
    for (bool is_full = true; (input.pos < input.size || is_full) && !is_damaged;) {
      ZSTD_outBuffer output{out.data(), out.size(), 0};
      hint = ZSTD_decompressStream(stream.get(), &output, &input);
      is_damaged = ZSTD_isError(hint) != 0U;
      is_full = output.pos == output.size;
      num_out += output.pos;
      if (num_out > limits::kMaxBagFileBytes) {
        return absl::InvalidArgumentError(absl::StrCat(file.path(), ": decompresses to more than ",
                                                       limits::kMaxBagFileBytes, " bytes"));
      }
      RETURN_IF_ERROR(plain->Write({out.data(), output.pos}));
    }
  }
  const std::string what =
      hint == 0 ? absl::StrCat(file.path(), ", decompressed")
                : absl::StrCat(file.path(), " is ", is_damaged ? "damaged" : "cut off", ": ",
                               num_out, " bytes of it could be decompressed");
  absl::StatusOr<std::unique_ptr<BagFile>> bag = OpenBagFile(plain->path());
  if (!bag.ok()) return Annotate(bag.status(), what);
  if (hint != 0) (*bag)->AddNote(absl::StrCat(what, "; what they hold is read"));
  return bag;
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(file.path(), ": out of memory"));
}

}  // namespace

std::string ShortType(std::string_view type) {
  const std::size_t msg = type.find("/msg/");
  if (msg == std::string_view::npos) return std::string(type);
  return absl::StrCat(ToAbsl(type.substr(0, msg)), ToAbsl(type.substr(msg + 4)));
}

absl::StatusOr<std::unique_ptr<BagFile>> OpenBagFile(const std::string& path) {
  ASSIGN_OR_RETURN(const RandomFile file, RandomFile::Open(path));
  ASSIGN_OR_RETURN(const std::string begin,
                   file.ReadText(0, std::min<std::uint64_t>(64, file.size())));
  for (const Kind& kind : kKinds) {
    if (begin.compare(0, kind.magic.size(), kind.magic) == 0) return kind.open(path);
  }
  if (begin.compare(0, kZstdMagic.size(), kZstdMagic) == 0) return OpenCompressed(file);
  RETURN_IF_ERROR(CheckIsItself(path, begin));
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": is no bag; MCAP, rosbag2's .db3 and ROS 1's .bag are read"));
}

}  // namespace scanloc::dataset
