#include "bag/decompress.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"

namespace scanloc::dataset {
namespace {

// Bytes come out at `out` until `left` is 0, the input ends, or it is damaged.
struct Output {
  char* out;
  std::size_t left;
  bool is_damaged = false;
  bool is_more = false;  ///< the input goes on though nothing is left
};

void RunZstd(std::string_view bytes, Output& output) {
  struct Free {
    void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
  };
  const std::unique_ptr<ZSTD_DStream, Free> stream(ZSTD_createDStream());
  if (stream == nullptr) throw std::bad_alloc();
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  ZSTD_outBuffer out{output.out, output.left, 0};
  // A full output may only lack the end of its frame, which is taken in without bytes coming out.
  std::size_t hint = 1;
  while (in.pos < in.size) {
    const std::size_t before_in = in.pos;
    const std::size_t before_out = out.pos;
    hint = ZSTD_decompressStream(stream.get(), &out, &in);
    if (ZSTD_isError(hint) != 0U) break;
    if (in.pos == before_in && out.pos == before_out) {
      output.is_more = true;
      break;
    }
  }
  output.is_damaged = hint != 0;  // 0 after a whole frame
  output.left -= out.pos;
}

void RunLz4(std::string_view bytes, Output& output) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0U) {
    throw std::bad_alloc();
  }
  struct Free {
    void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
  };
  const std::unique_ptr<LZ4F_dctx, Free> context(raw);
  while (!bytes.empty()) {
    std::size_t num_out = output.left;
    std::size_t num_in = bytes.size();
    const std::size_t hint =
        LZ4F_decompress(context.get(), output.out, &num_out, bytes.data(), &num_in, nullptr);
    if (LZ4F_isError(hint) != 0U) {
      output.is_damaged = true;
      return;
    }
    output.out += num_out;
    output.left -= num_out;
    bytes.remove_prefix(num_in);
    if (hint == 0) return;
    if (num_in == 0 && num_out == 0) {
      output.is_more = true;
      return;
    }
  }
  output.is_damaged = true;  // the end of the frame is missing
}

void RunBz2(std::string_view bytes, Output& output) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();
  struct End {
    bz_stream* stream;
    ~End() { BZ2_bzDecompressEnd(stream); }
  } const end{&stream};
  constexpr std::size_t kMost = std::numeric_limits<unsigned>::max();
  // bzlib takes its input as char* but does not write to it.
  stream.next_in = const_cast<char*>(bytes.data());
  stream.avail_in = static_cast<unsigned>(std::min(bytes.size(), kMost));
  stream.next_out = output.out;
  stream.avail_out = static_cast<unsigned>(std::min(output.left, kMost));
  const std::size_t before = stream.avail_out;
  while (true) {
    const unsigned in = stream.avail_in;
    const unsigned out = stream.avail_out;
    const int result = BZ2_bzDecompress(&stream);
    if (result == BZ_STREAM_END) break;
    if (result != BZ_OK) {
      output.is_damaged = true;
      break;
    }
    if (stream.avail_in == in && stream.avail_out == out) {
      output.is_more = in > 0;
      break;
    }
  }
  output.left -= before - stream.avail_out;
}

absl::Status Damaged(std::string_view what) {
  return absl::DataLossError(
      absl::StrCat("compressed bytes are damaged: ", absl::string_view(what.data(), what.size())));
}

}  // namespace

std::optional<Compression> ParseCompression(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Compression>, 5> kNames = {
      {{"", Compression::kNone},
       {"none", Compression::kNone},
       {"zstd", Compression::kZstd},
       {"lz4", Compression::kLz4},
       {"bz2", Compression::kBz2}}};
  for (const auto& [known, compression] : kNames) {
    if (known == name) return compression;
  }
  return std::nullopt;
}

absl::StatusOr<FileBytes> Decompress(Compression compression, std::string_view bytes,
                                     std::size_t num_bytes, CutOff cut_off,
                                     SpareMemory* memory) try {
  // new[] without a value leaves the bytes, and with them the pages, untouched.
  ByteArray data = memory != nullptr
                       ? memory->Take(num_bytes)
                       : std::unique_ptr<char[]>(new char[std::max<std::size_t>(num_bytes, 1)]);
  Output output{data.get(), num_bytes};
  switch (compression) {
    case Compression::kNone:
      output.is_more = bytes.size() > num_bytes;
      std::memcpy(data.get(), bytes.data(), std::min(num_bytes, bytes.size()));
      output.left -= std::min(num_bytes, bytes.size());
      break;
    case Compression::kZstd:
      RunZstd(bytes, output);
      break;
    case Compression::kLz4:
      RunLz4(bytes, output);
      break;
    case Compression::kBz2:
      RunBz2(bytes, output);
      break;
  }
  if (output.is_more) return Damaged(absl::StrCat("more than the announced ", num_bytes, " bytes"));
  const std::size_t num_out = num_bytes - output.left;
  if (cut_off == CutOff::kKeepWhatCame) return FileBytes(std::move(data), num_out);
  if (output.is_damaged || (output.left > 0 && cut_off == CutOff::kRefuse)) {
    return Damaged(absl::StrCat(num_out, " of ", num_bytes, " bytes came out"));
  }
  return FileBytes(std::move(data), num_out);
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(
      absl::StrCat("no memory to decompress ", num_bytes, " bytes"));
}

absl::StatusOr<FileBytes> DecompressZstd(std::string_view bytes, std::size_t max_bytes) {
  const unsigned long long told = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (told == ZSTD_CONTENTSIZE_ERROR) return Damaged("no zstd frame");
  if (told != ZSTD_CONTENTSIZE_UNKNOWN) {
    if (told > max_bytes) {
      return absl::InvalidArgumentError(
          absl::StrCat("compressed bytes announce ", told, "; at most ", max_bytes, " are read"));
    }
    return Decompress(Compression::kZstd, bytes, told);
  }
  return Decompress(Compression::kZstd, bytes, max_bytes, CutOff::kAnySize);
}

}  // namespace scanloc::dataset
