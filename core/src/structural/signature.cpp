#include "structural/signature.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "scan/simd.hpp"

namespace scanloc {
namespace {

constexpr std::size_t kNumSectors = BearingGrid::kNumSectors;
/// Where each group of rings begins, and where the last one ends: those near the sensor are narrow.
constexpr std::array<std::size_t, 7> kGroups = {0, 2, 4, 6, 9, 12, BearingGrid::kNumRings};
constexpr std::size_t kNumGroups = kGroups.size() - 1;
constexpr std::size_t kNumFrequencies = 6;
/// What a group's mean says, against its magnitudes.
constexpr float kWeightOfMean = 0.5F;

/// A mean a group, a magnitude a group and frequency, and a complex number for each of these and
/// the next group.
constexpr std::size_t kNumMagnitudes = kNumGroups * (1 + kNumFrequencies);
constexpr std::size_t kNumOfBearings = kNumMagnitudes + 2 * (kNumGroups - 1) * kNumFrequencies;

constexpr std::size_t WholePairs(std::size_t size) { return (size + 1) / 2 * 2; }

/// The first frequencies over the sectors, in whole numbers, so that sums are exact.
struct Waves {
  static constexpr int kAmplitude = 4096;
  using Wave = std::array<std::int16_t, kNumSectors>;

  std::array<Wave, kNumFrequencies> cosine, sine;

  Waves() {
    for (std::size_t f = 0; f < kNumFrequencies; ++f) {
      for (std::size_t s = 0; s < kNumSectors; ++s) {
        const double angle_rad = 2.0 * std::numbers::pi / static_cast<double>(kNumSectors) *
                                 static_cast<double>((f + 1) * s % kNumSectors);
        cosine[f][s] = static_cast<std::int16_t>(std::lround(kAmplitude * std::cos(angle_rad)));
        sine[f][s] = static_cast<std::int16_t>(std::lround(kAmplitude * std::sin(angle_rad)));
      }
    }
  }
};

struct Spectrum {
  float mean = 0.0F;
  std::array<float, kNumFrequencies> real{}, imaginary{}, magnitude{};
};

SCANLOC_SIMD Spectrum SpectrumOf(std::span<const std::uint64_t> rings, const Waves& waves) {
  std::array<std::int16_t, kNumSectors> signal{};
  for (const std::uint64_t ring : rings) {
    for (std::size_t s = 0; s < kNumSectors; ++s) {
      signal[s] = static_cast<std::int16_t>(signal[s] + static_cast<int>(ring >> s & 1U));
    }
  }
  Spectrum spectrum;
  std::int32_t sum = 0;
  for (const std::int16_t value : signal) sum += value;
  spectrum.mean = static_cast<float>(Waves::kAmplitude * sum);
  for (std::size_t f = 0; f < kNumFrequencies; ++f) {
    std::int32_t real = 0;
    std::int32_t imaginary = 0;
    for (std::size_t s = 0; s < kNumSectors; ++s) {
      real += signal[s] * waves.cosine[f][s];
      imaginary += signal[s] * waves.sine[f][s];
    }
    spectrum.real[f] = static_cast<float>(real);
    spectrum.imaginary[f] = static_cast<float>(imaginary);
    spectrum.magnitude[f] = __builtin_sqrtf(spectrum.real[f] * spectrum.real[f] +
                                            spectrum.imaginary[f] * spectrum.imaginary[f]);
  }
  return spectrum;
}

}  // namespace

SignatureShape::SignatureShape(int num_polar_rows, int num_cart_rows)
    : bearings_{0, WholePairs(kNumOfBearings)},
      polar_{bearings_.size, WholePairs(static_cast<std::size_t>(num_polar_rows))},
      cart_{polar_.begin + polar_.size, WholePairs(static_cast<std::size_t>(num_cart_rows))} {}

void WriteBearings(const BearingGrid& widened, double scale, std::span<std::int8_t> part) {
  static const Waves kWaves;
  // As narrow as they may have been: what is wide looks alike in all directions.
  BearingGrid::Rings rings;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const std::uint64_t ring = widened.rings()[i];
    rings[i] = ring & std::rotl(ring, 1) & std::rotr(ring, 1);
  }
  std::array<Spectrum, kNumGroups> spectra;
  for (std::size_t g = 0; g < kNumGroups; ++g) {
    spectra[g] =
        SpectrumOf(std::span(rings).subspan(kGroups[g], kGroups[g + 1] - kGroups[g]), kWaves);
  }
  std::array<float, kNumOfBearings> values;
  auto next = values.begin();
  for (const Spectrum& spectrum : spectra) {
    *next++ = kWeightOfMean * spectrum.mean;
    next = std::ranges::copy(spectrum.magnitude, next).out;
  }
  for (std::size_t g = 0; g + 1 < kNumGroups; ++g) {
    const Spectrum& a = spectra[g];
    const Spectrum& b = spectra[g + 1];
    for (std::size_t f = 0; f < kNumFrequencies; ++f) {
      // As long as both are on (geometric) average.
      const float length = std::sqrt(a.magnitude[f] * b.magnitude[f]);
      const float over = length > 0.0F ? 1.0F / length : 0.0F;
      *next++ = over * (a.real[f] * b.real[f] + a.imaginary[f] * b.imaginary[f]);
      *next++ = over * (a.imaginary[f] * b.real[f] - a.real[f] * b.imaginary[f]);
    }
  }
  WriteScaled(values, scale, part);
}

void WriteKey(std::span<const std::int32_t> retrieval_cm, double scale,
              std::span<std::int8_t> part) {
  const std::vector<float> values(retrieval_cm.begin(), retrieval_cm.end());
  WriteScaled(values, scale, part);
}

SCANLOC_SIMD void WriteScaled(std::span<const float> values, double scale,
                              std::span<std::int8_t> part) {
  double square = 0.0;
  for (const float value : values) square += double{value} * double{value};
  const auto factor = static_cast<float>(square > 0.0 ? scale / std::sqrt(square) : 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float scaled = factor * values[i];
    part[i] = static_cast<std::int8_t>(static_cast<int>(scaled + std::copysign(0.5F, scaled)));
  }
  std::fill(part.begin() + static_cast<std::ptrdiff_t>(values.size()), part.end(), std::int8_t{0});
}

}  // namespace scanloc
