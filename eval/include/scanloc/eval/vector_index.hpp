#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace scanloc::eval {

/// Vectors by number, searched one by one. Thread-safe once filled.
class VectorIndex {
 public:
  /// Requires vectors of one length. A zero vector stands for what could not be described: it is
  /// never found.
  void Add(const Eigen::VectorXf& vector) { vectors_.push_back(vector); }
  [[nodiscard]] std::size_t size() const { return vectors_.size(); }

  struct Neighbor {
    std::size_t number = 0;
    double distance = 0.0;
  };
  /// The k nearest, nearest first; of equal ones the lower number. Those whose element in
  /// `excluded` is true are passed over. A zero vector finds nothing. O(n).
  [[nodiscard]] std::vector<Neighbor> Search(const Eigen::VectorXf& query, std::size_t k,
                                             const std::vector<bool>* excluded = nullptr) const;

 private:
  std::vector<Eigen::VectorXf> vectors_;
};

}  // namespace scanloc::eval
