#include "support/pcl_refine.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>

#include <cmath>

namespace scanloc::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

/// GICP takes the covariance of so many neighbours.
constexpr std::size_t kLeastPoints = 20;

Cloud::Ptr ToCloud(PointView points) {
  const Cloud::Ptr cloud(new Cloud);
  cloud->reserve(points.size());
  for (const Point& p : points) cloud->push_back({p.x, p.y, p.z});
  return cloud;
}

/// PCL counts, and does not tell.
template <typename Registration>
struct Counting : Registration {
  [[nodiscard]] int num_iterations() const { return this->nr_iterations_; }
};

template <typename Registration>
Refined Run(PointView source, PointView target, const Pose& T_target_guess,
            const RefineLimits& limits) {
  Counting<Registration> registration;
  registration.setMaximumIterations(limits.most_iterations);
  registration.setMaxCorrespondenceDistance(limits.farthest_pair_m);
  registration.setTransformationEpsilon(1e-6);  // of the squared translation [m²]
  registration.setInputSource(ToCloud(source));
  registration.setInputTarget(ToCloud(target));
  Cloud aligned;
  registration.align(aligned, T_target_guess.matrix().cast<float>());
  Refined refined;
  refined.T_target_source.matrix() = registration.getFinalTransformation().template cast<double>();
  refined.has_converged = registration.hasConverged();
  refined.num_iterations = registration.num_iterations();
  refined.rmse_m = std::sqrt(registration.getFitnessScore());
  return refined;
}

}  // namespace

Refined Refine(Refiner refiner, PointView source, PointView target, const Pose& T_target_guess,
               const RefineLimits& limits) {
  if (source.size() < kLeastPoints || target.size() < kLeastPoints) {
    return {.T_target_source = T_target_guess};
  }
  if (refiner == Refiner::kIcp) {
    return Run<pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>>(source, target,
                                                                         T_target_guess, limits);
  }
  return Run<pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>>(
      source, target, T_target_guess, limits);
}

}  // namespace scanloc::bench
