#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/eval/evaluation.hpp"
#include "support/small_map.hpp"

namespace scanloc::test {

/// A small map whose places are 7 m apart, a query beside each, and one from elsewhere.
struct SmallEvaluation {
  static constexpr std::uint64_t kSeed = 5;
  static constexpr int kNumPlaces = 8;

  std::shared_ptr<const Localizer> localizer = LocalizerOf(SmallMap(kSeed, kNumPlaces));
  std::vector<eval::EvalQuery> queries;
  eval::EvalOptions options{.within_m = {8.0, 1.0},
                            .time_places = true,
                            .read_query = [](std::size_t i) -> absl::StatusOr<PointCloud> {
                              if (i == kNumPlaces) return scenes::PostScan(99, 80);
                              return QueryScan(kSeed, static_cast<int>(i));
                            },
                            .read_place = [](std::size_t i) -> absl::StatusOr<PointCloud> {
                              return PlaceScan(kSeed, static_cast<int>(i));
                            }};

  SmallEvaluation() {
    for (int place = 0; place < kNumPlaces; ++place) {
      eval::EvalQuery query{.name = absl::StrCat("query ", place)};
      query.T_map_true = localizer->map().places[static_cast<std::size_t>(place)].T_map_place *
                         PlanarOffset(0.3, 0.5 + 0.1 * place);
      queries.push_back(query);
    }
    queries.push_back({.name = "elsewhere"});
  }

  /// By these methods.
  std::vector<eval::MethodResult> Run(const std::vector<std::string>& methods,
                                      int num_threads = 1) {
    options.num_threads = num_threads;
    options.methods.clear();
    for (const std::string& name : methods) {
      options.methods.push_back(eval::ParseEvalMethod(name).value());
    }
    eval::FindRevisits(localizer->map(), options.within_m.front(), &queries);
    return eval::Evaluate(*localizer, queries, options, [](std::size_t) {}).value();
  }
};

}  // namespace scanloc::test
