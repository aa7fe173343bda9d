#include "map/place_tree.hpp"

#include <cstdint>
#include <limits>
#include <nanoflann.hpp>

namespace scanloc {
namespace {

/// Places as nanoflann asks for them.
struct Positions {
  const std::vector<Place>& places;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return places.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return places[i].T_map_place.translation()[static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

/// What a search keeps: the nearest place that is not excluded, the lowest of those equally near.
class NearestPlace {
 public:
  explicit NearestPlace(const std::vector<bool>* excluded) : excluded_(excluded) {}

  [[nodiscard]] std::optional<std::size_t> place() const { return place_; }

  // As nanoflann asks for them.
  bool addPoint(double distance_m2, std::uint32_t place) {
    if (excluded_ != nullptr && (*excluded_)[place]) return true;
    if (distance_m2 < least_m2_ || (distance_m2 == least_m2_ && place < place_)) {
      least_m2_ = distance_m2;
      place_ = place;
    }
    return true;
  }
  /// A little more than the least, so that no place is passed over that is as near.
  [[nodiscard]] double worstDist() const { return least_m2_ * (1.0 + 1e-9) + 1e-9; }
  [[nodiscard]] bool full() const { return place_.has_value(); }

 private:
  const std::vector<bool>* excluded_;
  double least_m2_ = std::numeric_limits<double>::max();
  std::optional<std::size_t> place_;
};

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Positions>,
                                                   Positions, 3, std::uint32_t>;

}  // namespace

struct PlaceTree::Tree {
  explicit Tree(const std::vector<Place>& places) : positions{places}, tree(3, positions) {}
  Positions positions;
  KdTree tree;
};

PlaceTree::PlaceTree(const std::vector<Place>& places)
    : tree_(std::make_unique<const Tree>(places)) {}

PlaceTree::~PlaceTree() = default;

std::optional<std::size_t> PlaceTree::Nearest(const Eigen::Vector3d& position_m,
                                              const std::vector<bool>* excluded) const {
  NearestPlace nearest(excluded);
  tree_->tree.findNeighbors(nearest, position_m.data(), nanoflann::SearchParams());
  return nearest.place();
}

}  // namespace scanloc
