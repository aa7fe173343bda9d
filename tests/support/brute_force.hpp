#pragma once

#include <vector>

#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/point_cloud.hpp"
#include "scanloc/core/scan_context/match.hpp"

/// Slow and obvious references for core: double precision, atan2, maps and nested loops.
namespace scanloc::brute_force {

/// The centroids of a scan's occupied voxels, ordered by voxel.
std::vector<std::vector<double>> VoxelCentroids(PointView scan, double voxel_size_m);

/// Heights [m] of the polar context, [ring][sector], of points as they are (no voxel filter).
std::vector<std::vector<double>> PolarHeights_m(PointView points, const Params& params,
                                                double root_shift_m);

/// Heights [m] of the cart context, [row][col].
std::vector<std::vector<double>> CartHeights_m(PointView points, const Params& params);

/// Eq. imgDist with the columns of the query shifted, as Match documents it.
double Distance(const ContextView& query, const ContextView& place, int shift, ShiftMode mode);

}  // namespace scanloc::brute_force
