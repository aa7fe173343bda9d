#include "scanloc/dataset/radar.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <new>
#include <numbers>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "file_bytes.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/status_macros.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

constexpr std::size_t kNumOxfordHeadColumns = 11;
constexpr unsigned kOxfordSteps = 5600;  // of the encoder, a turn

struct GreyImage {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint8_t> pixels;  // row by row

  [[nodiscard]] std::uint8_t at(std::size_t row, std::size_t col) const {
    return pixels[row * width + col];
  }
};

// libpng's own simplified reading: no longjmp passes through this code.
class Png {
 public:
  Png() { image_.version = PNG_IMAGE_VERSION; }
  ~Png() { png_image_free(&image_); }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;

  absl::StatusOr<GreyImage> Decode(std::string_view bytes) {
    if (png_image_begin_read_from_memory(&image_, bytes.data(), bytes.size()) == 0) return Bad();
    constexpr png_uint_32 kUnread =
        PNG_FORMAT_FLAG_COLOR | PNG_FORMAT_FLAG_ALPHA | PNG_FORMAT_FLAG_LINEAR;
    if ((image_.format & kUnread) != 0) {
      return Invalid("the image is not of 8-bit greys, as radar images are");
    }
    if (std::uint64_t{image_.width} * image_.height > limits::kMaxPointsPerScan) {
      return Invalid(absl::StrCat("the image has ", image_.width, " x ", image_.height,
                                  " pixels; at most ", limits::kMaxPointsPerScan, " are read"));
    }
    image_.format = PNG_FORMAT_GRAY;
    GreyImage grey{image_.width, image_.height, {}};
    grey.pixels.resize(grey.width * grey.height);
    if (png_image_finish_read(&image_, nullptr, grey.pixels.data(), 0, nullptr) == 0) return Bad();
    return grey;
  }

 private:
  [[nodiscard]] absl::Status Bad() const {
    return Invalid(absl::StrCat("no whole PNG image: ", Quote(image_.message)));
  }

  png_image image_{};
};

class RadarScan {
 public:
  RadarScan(std::size_t num_pixels, double resolution_m) : resolution_m_(resolution_m) {
    scan_.points.reserve(num_pixels);
    scan_.intensities.reserve(num_pixels);
  }

  // In the middle of the range bin; clockwise.
  void AddPolar(std::size_t bin, double cosine, double sine, std::uint8_t power) {
    const double range_m = (static_cast<double>(bin) + 0.5) * resolution_m_;
    Add(range_m * cosine, -range_m * sine, power);
  }
  void Add(double x_m, double y_m, std::uint8_t power) {
    scan_.points.push_back({static_cast<float>(x_m), static_cast<float>(y_m), 0.0F});
    scan_.intensities.push_back(power);
  }
  [[nodiscard]] Scan Take() { return std::move(scan_); }

 private:
  double resolution_m_;
  Scan scan_;
};

absl::StatusOr<Scan> FromOxford(const GreyImage& image, RadarScan scan) {
  if (image.width <= kNumOxfordHeadColumns) {
    return Invalid(absl::StrCat("the image has ", image.width, " columns; Oxford's begin with ",
                                kNumOxfordHeadColumns, " that are no range"));
  }
  for (std::size_t row = 0; row < image.height; ++row) {
    const unsigned step = image.at(row, 8) + 256U * image.at(row, 9);
    const unsigned is_measured = image.at(row, 10);
    if (step >= kOxfordSteps || (is_measured != 0 && is_measured != 255)) {
      return Invalid(absl::StrCat("row ", row, " has step ", step, " of ", kOxfordSteps,
                                  " and the mark ", is_measured,
                                  ": no image of Oxford's layout, whose rows begin with time, step "
                                  "and 0 or 255"));
    }
    const double azimuth_rad = 2.0 * std::numbers::pi * step / kOxfordSteps;
    const double cosine = std::cos(azimuth_rad), sine = std::sin(azimuth_rad);
    for (std::size_t col = kNumOxfordHeadColumns; col < image.width; ++col) {
      scan.AddPolar(col - kNumOxfordHeadColumns, cosine, sine, image.at(row, col));
    }
  }
  return scan.Take();
}

absl::StatusOr<Scan> FromMulran(const GreyImage& image, RadarScan scan) {
  // Read as another layout, an image of Oxford's would be taken for ranges of some metres.
  if (image.width >= image.height) {
    return Invalid(absl::StrCat("the image has ", image.width, " columns and ", image.height,
                                " rows; MulRan's have fewer azimuths, their columns, than steps "
                                "of range, their rows"));
  }
  for (std::size_t col = 0; col < image.width; ++col) {
    const double azimuth_rad =
        2.0 * std::numbers::pi * static_cast<double>(col) / static_cast<double>(image.width);
    const double cosine = std::cos(azimuth_rad), sine = std::sin(azimuth_rad);
    for (std::size_t row = 0; row < image.height; ++row) {
      scan.AddPolar(row, cosine, sine, image.at(row, col));
    }
  }
  return scan.Take();
}

absl::StatusOr<Scan> FromCartesian(const GreyImage& image, double resolution_m, RadarScan scan) {
  if (image.width != image.height) {
    return Invalid(absl::StrCat("the image has ", image.width, " columns and ", image.height,
                                " rows; one from above is square, with the radar in the middle"));
  }
  const double half = 0.5 * static_cast<double>(image.width) - 0.5;
  for (std::size_t row = 0; row < image.height; ++row) {
    for (std::size_t col = 0; col < image.width; ++col) {
      scan.Add((half - static_cast<double>(row)) * resolution_m,
               (half - static_cast<double>(col)) * resolution_m, image.at(row, col));
    }
  }
  return scan.Take();
}

}  // namespace

std::optional<double> DefaultResolution_m(RadarLayout layout) {
  if (layout == RadarLayout::kOxford) return 0.0432;
  if (layout == RadarLayout::kMulran) return 0.0595;
  return std::nullopt;
}

absl::StatusOr<Scan> DecodeRadar(std::string_view png, RadarLayout layout, double resolution_m) {
  ASSIGN_OR_RETURN(const GreyImage image, Png().Decode(png));
  RadarScan scan(image.pixels.size(), resolution_m);
  if (layout == RadarLayout::kOxford) return FromOxford(image, std::move(scan));
  if (layout == RadarLayout::kMulran) return FromMulran(image, std::move(scan));
  return FromCartesian(image, resolution_m, std::move(scan));
}

absl::StatusOr<Scan> ReadRadar(const std::string& path, RadarLayout layout,
                               double resolution_m) try {
  ASSIGN_OR_RETURN(const FileBytes bytes, ReadFileBytes(path, limits::kMaxScanFileBytes));
  absl::StatusOr<Scan> scan = DecodeRadar(bytes.view(), layout, resolution_m);
  return scan.ok() ? std::move(scan) : Annotate(scan.status(), path);
} catch (const std::bad_alloc&) {
  return absl::ResourceExhaustedError(absl::StrCat(path, ": out of memory"));
}

absl::StatusOr<std::vector<RadarFile>> ListRadar(const std::string& folder) {
  std::error_code error;
  std::filesystem::directory_iterator files(folder, error);
  if (error) {
    return absl::NotFoundError(absl::StrCat(folder, ": cannot be listed: ", error.message()));
  }
  std::vector<RadarFile> found;
  for (; files != std::filesystem::directory_iterator(); files.increment(error)) {
    const std::string name = files->path().filename().string();
    if (name.starts_with('.') || !absl::EndsWithIgnoreCase(name, ".png")) continue;
    const std::optional<std::int64_t> stamp_ns = StampOfName(name);
    if (!stamp_ns) {
      return Invalid(absl::StrCat(folder,
                                  ": the name of a radar image must be its time, 19 digits "
                                  "in ns or 16 in us; ",
                                  Quote(name), " is not"));
    }
    found.push_back({*stamp_ns, files->path().string()});
  }
  if (error) return absl::UnavailableError(absl::StrCat(folder, ": ", error.message()));
  if (found.empty()) return Invalid(absl::StrCat(folder, ": holds no .png"));
  std::ranges::sort(found, {}, &RadarFile::stamp_ns);
  return found;
}

}  // namespace scanloc::dataset
