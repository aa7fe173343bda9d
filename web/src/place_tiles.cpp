#include "place_tiles.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

namespace scanloc::web {
namespace {

static_assert(std::endian::native == std::endian::little);

/// A square is sampled by the first place in each cell of such a grid.
constexpr int kCells = 48;
constexpr std::size_t kLeafPlaces = 2048;
/// Storeys lie farther apart than this, and places on one floor or road closer.
constexpr float kFloorGap_m = 1.5F;
constexpr std::size_t kMaxFloors = 30;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

std::uint32_t SecondsSince(std::int64_t first_ns, std::int64_t stamp_ns) {
  if (stamp_ns == 0) return 0;
  const std::int64_t seconds = (stamp_ns - first_ns) / kNsPerSecond + 1;
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(seconds, 1, std::numeric_limits<std::uint32_t>::max()));
}

std::uint16_t Turn16(double heading_rad) {
  const double turns = heading_rad / (2.0 * std::numbers::pi);
  return static_cast<std::uint16_t>(
      static_cast<std::int64_t>(std::lround((turns - std::floor(turns)) * 65536.0)) & 0xffff);
}

}  // namespace

PlaceTiles::PlaceTiles(std::string content_id, const std::vector<Place>& places)
    : content_id_(std::move(content_id)) {
  if (places.empty()) return;
  Eigen::Vector3d low = places.front().T_map_place.translation();
  Eigen::Vector3d high = low;
  for (const Place& place : places) {
    low = low.cwiseMin(place.T_map_place.translation());
    high = high.cwiseMax(place.T_map_place.translation());
    if (place.stamp_ns > 0 && (first_stamp_ns_ == 0 || place.stamp_ns < first_stamp_ns_)) {
      first_stamp_ns_ = place.stamp_ns;
    }
  }
  origin_m_ = low;
  for (const Place& place : places) {
    positions_.emplace_back((place.T_map_place.translation() - low).cast<float>());
    stamps_s_.push_back(SecondsSince(first_stamp_ns_, place.stamp_ns));
    sessions_.push_back(static_cast<std::uint16_t>(std::min(place.session, 65535)));
    headings_.push_back(Turn16(Yaw(place.T_map_place)));
  }
  const double side_m = std::max({high.x() - low.x(), high.y() - low.y(), 1.0}) * (1.0 + 1e-6);
  std::vector<std::uint32_t> all(places.size());
  std::iota(all.begin(), all.end(), 0U);
  order_.reserve(all.size());
  Split({0.0, 0.0, side_m}, 0, std::move(all));
  FindFloors();
}

void PlaceTiles::Split(const Square& square, int level, std::vector<std::uint32_t> places) {
  Tile tile{.level = level,
            .min_x_m = square.min_x_m,
            .min_y_m = square.min_y_m,
            .side_m = square.side_m,
            .first = static_cast<std::uint32_t>(order_.size())};
  std::array<std::vector<std::uint32_t>, 4> quarters;
  if (places.size() <= kLeafPlaces || level == kMaxLevel) {
    order_.insert(order_.end(), places.begin(), places.end());
  } else {
    std::vector<bool> is_taken(kCells * kCells, false);
    const auto cell_of = [&](float coordinate, double min_m) {
      return std::clamp(static_cast<int>((coordinate - min_m) / square.side_m * kCells), 0,
                        kCells - 1);
    };
    for (const std::uint32_t place : places) {
      const int col = cell_of(positions_[place].x(), square.min_x_m);
      const int row = cell_of(positions_[place].y(), square.min_y_m);
      auto is_first = is_taken[static_cast<std::size_t>(row * kCells + col)];
      if (!is_first) {
        is_first = true;
        order_.push_back(place);
      } else {
        quarters[(col < kCells / 2 ? 0 : 1) + (row < kCells / 2 ? 0 : 2)].push_back(place);
      }
    }
  }
  tile.count = static_cast<std::uint32_t>(order_.size()) - tile.first;
  tiles_.push_back(tile);
  places = {};
  const double half_m = square.side_m / 2.0;
  for (std::size_t i = 0; i < quarters.size(); ++i) {
    if (quarters[i].empty()) continue;
    Split({square.min_x_m + (i % 2 == 0 ? 0.0 : half_m), square.min_y_m + (i < 2 ? 0.0 : half_m),
           half_m},
          level + 1, std::move(quarters[i]));
  }
}

void PlaceTiles::FindFloors() {
  std::vector<float> heights;
  heights.reserve(positions_.size());
  for (const Eigen::Vector3f& position : positions_) heights.push_back(position.z());
  std::ranges::sort(heights);
  const auto add = [&](std::size_t begin, std::size_t end) {
    floors_.push_back({.min_z_m = origin_m_.z() + heights[begin],
                       .max_z_m = origin_m_.z() + heights[end - 1],
                       .count = static_cast<std::uint32_t>(end - begin)});
  };
  std::size_t begin = 0;
  for (std::size_t i = 1; i < heights.size(); ++i) {
    if (heights[i] - heights[i - 1] <= kFloorGap_m) continue;
    add(begin, i);
    begin = i;
  }
  add(begin, heights.size());
  if (floors_.size() <= kMaxFloors) return;
  floors_.clear();
  add(0, heights.size());
}

std::string PlaceTiles::Rows(const Tile& tile) const {
  std::string rows(tile.count * kRowBytes, '\0');
  char* out = rows.data();
  const auto put = [&out](const auto& value) {
    std::memcpy(out, &value, sizeof(value));
    out += sizeof(value);
  };
  for (std::uint32_t i = tile.first; i < tile.first + tile.count; ++i) {
    const std::uint32_t place = order_[i];
    put(place);
    for (int axis = 0; axis < 3; ++axis) put(positions_[place][axis]);
    put(stamps_s_[place]);
    put(sessions_[place]);
    put(headings_[place]);
  }
  return rows;
}

}  // namespace scanloc::web
