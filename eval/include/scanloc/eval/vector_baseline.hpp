#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "scanloc/eval/baseline.hpp"

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

/// A baseline that compares one vector a scan. Vectors are of one length and finite; a zero vector,
/// of a scan that cannot be described, is like no other.
class VectorBaseline : public Baseline {
 public:
  void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) override;
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override;

 protected:
  /// The vector of the query.
  [[nodiscard]] virtual Eigen::VectorXf VectorOf(const BaselineQuery& query) const {
    return Describe(query.scan);
  }

 private:
  const Map* map_ = nullptr;
  VectorIndex index_;
};

enum class VectorDistance {
  kL2,
  kCosine,  ///< one less the cosine; told as such
};

/// Vectors that were made elsewhere, one a place and one a query, such as those of a learned
/// descriptor.
class ComputedDescriptors : public VectorBaseline {
 public:
  /// Of all queries by number, and all places. Requires them to be of one length and finite.
  ComputedDescriptors(std::string name, VectorDistance distance,
                      std::vector<Eigen::VectorXf> of_queries,
                      std::vector<Eigen::VectorXf> of_places);

  [[nodiscard]] std::string name() const override { return name_; }
  [[nodiscard]] bool needs_place_scans() const override { return false; }
  /// Takes the vectors given to the constructor.
  void Prepare(const Map& map, std::vector<Eigen::VectorXf> vectors) override;
  [[nodiscard]] Answer Recognize(const BaselineQuery& query) const override;

 protected:
  [[nodiscard]] Eigen::VectorXf VectorOf(const BaselineQuery& query) const override {
    return of_queries_[query.number];
  }

 private:
  std::string name_;
  VectorDistance distance_;
  std::vector<Eigen::VectorXf> of_queries_;
  std::vector<Eigen::VectorXf> of_places_;
};

}  // namespace scanloc::eval
