#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scanloc/core/point_cloud.hpp"

/// Other ways of recognising places, to compare with. One file each.
namespace scanloc::eval {

/// Describes a scan by one vector; like scans have vectors at a small Euclidean distance. One
/// thread at a time.
class Baseline {
 public:
  virtual ~Baseline() = default;
  Baseline() = default;
  Baseline(const Baseline&) = delete;
  Baseline& operator=(const Baseline&) = delete;

  /// As methods are named on the command line.
  [[nodiscard]] virtual std::string name() const = 0;

  /// Always of the same length and finite; points that are not finite are left out. Zero for a scan
  /// that cannot be described.
  [[nodiscard]] virtual Eigen::VectorXf Describe(PointView scan) = 0;
};

/// Null: no baseline has that name.
[[nodiscard]] std::unique_ptr<Baseline> MakeBaseline(const std::string& name);

/// The names, for people, with commas between.
[[nodiscard]] std::string BaselineNames();

/// Vectors by number, searched one by one. Thread-safe once filled.
class BaselineIndex {
 public:
  /// Requires vectors of one length.
  void Add(const Eigen::VectorXf& vector) { vectors_.push_back(vector); }
  [[nodiscard]] std::size_t size() const { return vectors_.size(); }

  struct Neighbor {
    std::size_t number = 0;
    double distance = 0.0;
  };
  /// The k nearest, nearest first; of equal ones the lower number. Those whose element in
  /// `excluded` is true are passed over. O(n).
  [[nodiscard]] std::vector<Neighbor> Search(const Eigen::VectorXf& query, std::size_t k,
                                             const std::vector<bool>* excluded = nullptr) const;

 private:
  std::vector<Eigen::VectorXf> vectors_;
};

}  // namespace scanloc::eval
