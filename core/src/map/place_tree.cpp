#include "map/place_tree.hpp"

#include <cstdint>
#include <limits>
#include <nanoflann.hpp>

#include "map/forest.hpp"

namespace scanloc {
namespace {

/// So few places are looked at one by one.
constexpr std::size_t kMinTree = 64;

/// A range of places as nanoflann asks for them.
struct Positions {
  const std::vector<Place>& places;
  std::size_t begin;
  std::size_t end;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return end - begin; }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return places[begin + i].T_map_place.translation()[static_cast<Eigen::Index>(axis)];
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

  /// Of the range that is searched next.
  void SetBegin(std::size_t begin) { begin_ = begin; }

  // As nanoflann asks for them.
  // NOLINTBEGIN(readability-identifier-naming)
  bool addPoint(double distance_m2, std::uint32_t number) {
    const std::size_t place = begin_ + number;
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
  // NOLINTEND(readability-identifier-naming)

 private:
  const std::vector<bool>* excluded_;
  std::size_t begin_ = 0;
  double least_m2_ = std::numeric_limits<double>::max();
  std::optional<std::size_t> place_;
};

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Positions>,
                                                   Positions, 3, std::uint32_t>;

struct Tree {
  Tree(const std::vector<Place>& places, std::size_t begin, std::size_t end)
      : positions{places, begin, end}, tree(3, positions) {}
  Positions positions;
  KdTree tree;
};

}  // namespace

struct PlaceTree::Trees {
  const std::vector<Place>& places;
  Forest<Tree> forest;
};

PlaceTree::PlaceTree(const std::vector<Place>& places)
    : trees_(std::make_unique<Trees>(Trees{places, {}})) {
  Extend();
}

PlaceTree::~PlaceTree() = default;

void PlaceTree::Extend() {
  const std::vector<Place>& places = trees_->places;
  trees_->forest.Grow(places.size(), kMinTree, [&](std::size_t begin, std::size_t end) {
    return std::make_unique<const Tree>(places, begin, end);
  });
}

std::optional<std::size_t> PlaceTree::Nearest(const Eigen::Vector3d& position_m,
                                              const std::vector<bool>* excluded) const {
  NearestPlace nearest(excluded);
  trees_->forest.ForEach([&](const Tree& tree, std::size_t begin) {
    nearest.SetBegin(begin);
    tree.tree.findNeighbors(nearest, position_m.data(), nanoflann::SearchParams());
  });
  const std::vector<Place>& places = trees_->places;
  nearest.SetBegin(trees_->forest.covered());
  for (std::size_t i = trees_->forest.covered(); i < places.size(); ++i) {
    const Eigen::Vector3d off_m = places[i].T_map_place.translation() - position_m;
    // Added up as nanoflann does, so that equally near is equally near.
    const double distance_m2 =
        off_m.x() * off_m.x() + off_m.y() * off_m.y() + off_m.z() * off_m.z();
    nearest.addPoint(distance_m2, static_cast<std::uint32_t>(i - trees_->forest.covered()));
  }
  return nearest.place();
}

}  // namespace scanloc
