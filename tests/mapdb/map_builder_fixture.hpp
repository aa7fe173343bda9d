#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/map_builder.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {

inline PlaceDescriptor SmallDescriptor(std::uint32_t seed) {
  auto describer = Describer::Create(test::SmallParams());
  return describer->DescribePlace(test::SmallScan(seed));
}

inline void ExpectStatus(const absl::Status& status, absl::StatusCode code,
                         const std::string& message) {
  EXPECT_EQ(status.code(), code) << status;
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr(message));
}

// Adds scans up to index `end`, each its own, and gives the builder's last status.
inline absl::Status AddUpTo(MapBuilder& builder, std::size_t end) {
  while (builder.next_scan() < end) {
    const auto seed = static_cast<std::uint32_t>(builder.next_scan() + 1);
    if (absl::Status status = builder.Add(SmallDescriptor(seed)); !status.ok()) return status;
  }
  return absl::OkStatus();
}

class MapBuilderTest : public testing::Test {
 protected:
  MapBuilder Created(std::size_t num_scans) {
    auto builder =
        MapBuilder::Create(path_, test::SmallParams(), test::SmallPlan("one", num_scans));
    EXPECT_TRUE(builder.ok()) << builder.status();
    return *std::move(builder);
  }
  // A map whose session "one" has `num_done` of `num_scans`.
  void Build(std::size_t num_scans, std::size_t num_done) {
    MapBuilder builder = Created(num_scans);
    EXPECT_TRUE(AddUpTo(builder, num_done).ok());
    EXPECT_TRUE(builder.Commit().ok());
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
};

}  // namespace scanloc::mapdb
