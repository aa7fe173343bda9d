#pragma once

#include <Eigen/Core>
#include <vector>

#include "random.hpp"
#include "town/town_site.hpp"
#include "worlds/scene.hpp"

namespace scanloc::sim {

/// A rectangle along the axes, in the plane.
struct Rect {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = Eigen::Vector2d::Zero();

  [[nodiscard]] Eigen::Vector2d center() const { return 0.5 * (low + high); }
  [[nodiscard]] Eigen::Vector2d size() const { return high - low; }
  [[nodiscard]] double area_m2() const { return size().x() * size().y(); }
};

/// Puts together a scene, storey by storey. What is built follows from the seed alone, what is
/// loose from the number of the session, too.
class SceneBuilder {
 public:
  explicit SceneBuilder(const SceneOptions& options);

  /// The storey on which the following stands: heights below are from its floor. Nothing loose will
  /// stand within `clear_m` of the way over this storey.
  void BeginStorey(double floor_m, const std::vector<Eigen::Vector2d>& way, double clear_m = 0.45);

  void Box(const Eigen::Vector2d& center, const Eigen::Vector2d& size, double low_m, double high_m,
           const Eigen::Vector2d& axis = Eigen::Vector2d::UnitX());
  void Slab(const Rect& rect, double low_m, double high_m) {
    Box(rect.center(), rect.size(), low_m, high_m);
  }
  void Round(const Eigen::Vector2d& center, double radius_m, double low_m, double high_m);
  void Wall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double high_m,
            double thickness_m = 0.15, double low_m = 0.0);
  /// With an open door whose middle is `door_at_m` from `from`, and a lintel above it.
  void WallWithDoor(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double door_at_m,
                    double door_width_m, double high_m);
  /// The four walls of a rectangle.
  void Walls(const Rect& rect, double high_m, double thickness_m = 0.2);
  void Tree(const Eigen::Vector2d& at, double ground_m, Random& random, double size);

  /// Of the next loose thing: it is the same on any visit, unless it changed.
  [[nodiscard]] Random NextThing() { return NextThing(changed_share_); }
  /// Of one that changes between any two sessions with this probability.
  [[nodiscard]] Random NextThing(double changed_share);

  /// Loose things of a dwelling or an office: some along the walls, some in the middle.
  void Furnish(const Rect& room, int count);
  /// Whoever happens to be there.
  void People(const Rect& where, int count);
  void Car(const Eigen::Vector2d& at, const Eigen::Vector2d& axis, Random& random);

  /// Puts the box if it stands in nobody's way and on nothing else that is loose.
  bool PutLoose(const Eigen::Vector2d& center, const Eigen::Vector2d& size, double low_m,
                double high_m, const Eigen::Vector2d& axis = Eigen::Vector2d::UnitX(),
                bool round = false);

  /// Continues the way through the scene, on the floor of this storey.
  void WalkTo(const Eigen::Vector2d& at, double above_floor_m = 0.0);
  void WalkAlong(const std::vector<Eigen::Vector2d>& way);

  [[nodiscard]] Scene& scene() { return scene_; }
  /// The way ends at length_m, if it is longer.
  [[nodiscard]] Scene Finish(double length_m);

 private:
  [[nodiscard]] Solid Make(SolidShape shape, const Eigen::Vector2d& center,
                           const Eigen::Vector2d& size, double low_m, double high_m,
                           const Eigen::Vector2d& axis) const;

  Scene scene_;
  std::uint64_t seed_;
  std::uint64_t session_seed_;
  double changed_share_;
  double floor_m_ = 0.0;
  std::uint64_t num_things_ = 0;
  Site site_;
};

}  // namespace scanloc::sim
