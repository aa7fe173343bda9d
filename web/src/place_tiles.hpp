#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "scanloc/core/map/map.hpp"

namespace scanloc::web {

/// The places of a map in squares of a quadtree, for whoever draws them: a square holds a sample of
/// the places in it, spread evenly, and its four quarters the others. What is drawn of a view is
/// the squares that it shows, down to those that are small on the screen: coarse from afar, all of
/// it from near, and never more than the view needs.
class PlaceTiles {
 public:
  static constexpr std::size_t kRowBytes = 24;
  static constexpr int kMaxLevel = 20;

  struct Tile {
    int level = 0;  ///< 0: the whole map; a square's quarters have one more
    double min_x_m = 0.0;
    double min_y_m = 0.0;
    double side_m = 0.0;
    std::uint32_t first = 0;  ///< row of its first place
    std::uint32_t count = 0;
  };

  /// Heights that places lie in with nothing between: floors of a building, or one for a town.
  struct Floor {
    double min_z_m = 0.0;
    double max_z_m = 0.0;
    std::uint32_t count = 0;
  };

  /// O(n log n).
  PlaceTiles(std::string content_id, const std::vector<Place>& places);

  [[nodiscard]] const std::string& content_id() const { return content_id_; }
  /// Of the coordinates in rows [m].
  [[nodiscard]] const Eigen::Vector3d& origin_m() const { return origin_m_; }
  [[nodiscard]] std::int64_t first_stamp_ns() const { return first_stamp_ns_; }
  [[nodiscard]] std::size_t num_places() const { return positions_.size(); }
  /// Parents before their quarters.
  [[nodiscard]] const std::vector<Tile>& tiles() const { return tiles_; }
  /// From below; one if there are more than 30 or the heights run through.
  [[nodiscard]] const std::vector<Floor>& floors() const { return floors_; }
  /// In the map frame.
  [[nodiscard]] Eigen::Vector3d Position(std::size_t place) const {
    return origin_m_ + positions_[place].cast<double>();
  }

  /// A row a place, little endian: uint32 index; float32 x, y, z from the origin [m]; uint32 stamp
  /// from the first, 0 if unknown [s]; uint16 session; uint16 heading [turn / 65536].
  [[nodiscard]] std::string Rows(const Tile& tile) const;

 private:
  struct Square {
    double min_x_m, min_y_m, side_m;
  };
  void Split(const Square& square, int level, std::vector<std::uint32_t> places);
  void FindFloors();

  std::string content_id_;
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  std::int64_t first_stamp_ns_ = 0;
  std::vector<Eigen::Vector3f> positions_;  // by place, as are the next three
  std::vector<std::uint32_t> stamps_s_;
  std::vector<std::uint16_t> sessions_;
  std::vector<std::uint16_t> headings_;
  std::vector<std::uint32_t> order_;  // places, tile after tile
  std::vector<Tile> tiles_;
  std::vector<Floor> floors_;
};

}  // namespace scanloc::web
