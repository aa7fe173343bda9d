#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace scanloc::sim {

/// Scrambles two numbers into one (splitmix64's finaliser).
inline std::uint64_t Mix(std::uint64_t a, std::uint64_t b) {
  std::uint64_t x = a + 0x9E3779B97F4A7C15ULL * (b + 1);
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

/// The upper 53 bits as a number in [0, 1).
inline double UnitInterval(std::uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1.0p-53;
}

/// Zero mean, unit variance, bell-shaped, within ±3.5, of the lower 48 bits: the sum of four
/// uniform numbers. Free of the maths library, so the same on any machine.
inline double BellShaped(std::uint64_t bits) {
  const auto part = [bits](int i) { return static_cast<double>((bits >> (12 * i)) & 0xFFFU); };
  const double sum = (part(0) + part(1)) + (part(2) + part(3)) + 2.0;
  return (sum / 4096.0 - 2.0) * 1.7320508075688772;
}

/// Random numbers that are the same with any standard library: <random> fixes its engines but not
/// its distributions. Use it at most once in an expression or argument list (not in braces): the
/// order of evaluation is the compiler's.
class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed) {}

  std::uint64_t Next() { return Mix(seed_, count_++); }
  double Uniform(double low, double high) { return low + (high - low) * UnitInterval(Next()); }
  /// In [0, count).
  int Index(int count) { return static_cast<int>(UnitInterval(Next()) * count); }
  bool Chance(double probability) { return UnitInterval(Next()) < probability; }
  double Bell() { return BellShaped(Next()); }

 private:
  std::uint64_t seed_;
  std::uint64_t count_ = 0;
};

/// (cos, sin) of an angle of moderate size, within 1e-15. The maths library's last bit differs from
/// machine to machine; plain arithmetic does not.
inline Eigen::Vector2d CosSin(double angle_rad) {
  constexpr double kQuarter_rad = 1.5707963267948966;
  constexpr double kQuarterRest_rad = 6.123233995736766e-17;
  const double quarters = std::floor(angle_rad / kQuarter_rad + 0.5);
  const double r = (angle_rad - quarters * kQuarter_rad) - quarters * kQuarterRest_rad;
  const double r2 = r * r;
  double sin = 1.0;
  for (int n = 16; n >= 2; n -= 2) sin = 1.0 - sin * r2 / (n * (n + 1));
  sin *= r;
  double cos = 1.0;
  for (int n = 15; n >= 1; n -= 2) cos = 1.0 - cos * r2 / (n * (n + 1));
  switch (static_cast<std::int64_t>(quarters) & 3) {
    case 0:
      return {cos, sin};
    case 1:
      return {-sin, cos};
    case 2:
      return {-cos, -sin};
    default:
      return {sin, -cos};
  }
}

inline double Radians(double degrees) { return degrees * (3.14159265358979323846 / 180.0); }

}  // namespace scanloc::sim
