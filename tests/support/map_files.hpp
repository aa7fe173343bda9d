#pragma once

#include <stdexcept>
#include <string>

#include "scanloc/mapdb/map_builder.hpp"
#include "support/small_map.hpp"

namespace scanloc::test {

/// Writes a map file of num_places places, made of the scans PlaceScan(seed, ...); with num_left
/// more in its plan it is half built.
inline void WriteSmallMap(const std::string& path, std::uint64_t seed, int num_places,
                          const Params& params = {}, int num_left = 0) {
  const auto check = [](const absl::Status& status) {
    if (!status.ok()) throw std::runtime_error(status.ToString());
  };
  mapdb::SessionPlan plan{.name = "morning", .scans = {}};
  for (int i = 0; i < num_places + num_left; ++i) {
    plan.scans.push_back({.name = absl::StrCat("scan-", i),
                          .stamp_ns = i,
                          .T_map_place = Pose(Eigen::Translation3d(7.1 * i, 0.3 * i, 0.01 * i))});
  }
  auto builder = mapdb::MapBuilder::Create(path, params, plan);
  check(builder.status());
  auto describer = Describer::Create(params).value();
  for (int i = 0; i < num_places; ++i) {
    check(builder->Add(describer.DescribePlace(PlaceScan(seed, i))));
  }
  check(num_left > 0 ? builder->Commit() : builder->Finish().status());
}

}  // namespace scanloc::test
