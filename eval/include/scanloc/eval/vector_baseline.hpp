#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "scanloc/eval/baseline.hpp"
#include "scanloc/eval/vector_index.hpp"

namespace scanloc::eval {

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
