#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "scanloc/sim/simulated_drive.hpp"
#include "scanloc/sim/town.hpp"
#include "scanloc/sim/world.hpp"

namespace scanloc::sim {

/// A world on one visit, and the way through it.
struct Scene {
  Ground ground;
  std::vector<Solid> solids;
  /// The corners of the way, on the floor; at least two, of which no two in a row are the same.
  std::vector<Eigen::Vector3d> walk;
};

/// What a maker of scenes goes by.
struct SceneOptions {
  std::uint64_t seed = 1;          ///< of what is built
  std::uint64_t session_seed = 1;  ///< of what is loose
  double length_m = 1000.0;
  WorldOptions world;
};

/// Of any kind but kTown. Requires valid options.
[[nodiscard]] Scene MakeScene(const SceneOptions& options);

[[nodiscard]] Scene MakeCampus(const SceneOptions& options);
[[nodiscard]] Scene MakeForest(const SceneOptions& options);
[[nodiscard]] Scene MakeTunnel(const SceneOptions& options);
[[nodiscard]] Scene MakeWarehouse(const SceneOptions& options);
[[nodiscard]] Scene MakeOffice(const SceneOptions& options);
[[nodiscard]] Scene MakeGarage(const SceneOptions& options);
[[nodiscard]] Scene MakeHome(const SceneOptions& options);
[[nodiscard]] Scene MakeRoom(const SceneOptions& options);
[[nodiscard]] Scene MakeCornerRoom(const SceneOptions& options);
[[nodiscard]] Scene MakeHall(const SceneOptions& options);

}  // namespace scanloc::sim
