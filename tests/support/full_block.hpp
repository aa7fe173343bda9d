#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "scanloc/core/localizer.hpp"
#include "support/same_answer.hpp"
#include "support/small_maps.hpp"

/// A map file whose keys fill a block (SharedBlocks), and what is looked at of its next version.
namespace scanloc::test {

inline constexpr std::size_t kFullBlockPlaces = 1960;
/// With so many contexts a place, and the first scan of that seed, these have one full block of
/// keys, which ends at place 1940.
inline constexpr std::uint32_t kFullBlockSeed = 7486;

inline Params ManyShifts() {
  Params params = SmallParams();
  params.cart.enabled = false;
  params.structure.enabled = false;
  for (int i = 2; i < 16; ++i) params.polar.root_shifts_m.push_back(0.5 * i);
  return params;
}

inline void BuildFullBlock(const std::string& path,
                           const mapdb::ScanLoader& load = SmallLoader(kFullBlockSeed)) {
  mapdb::BuildOptions options = SmallOptions(path);
  options.params = ManyShifts();
  options.commit_interval = 1000;
  ASSERT_TRUE(BuildMap(options, SmallPlan("one", kFullBlockPlaces), load).ok());
}

/// 60 places more.
inline void AppendToFullBlock(const std::string& path) {
  mapdb::BuildOptions options = SmallOptions(path, mapdb::BuildMode::kAppend);
  options.params = ManyShifts();
  ASSERT_TRUE(BuildMap(options, SmallPlan("two", 60), SmallLoader(50'000)).ok());
}

inline const std::vector<std::shared_ptr<const KeyBlock>>& BlocksOf(const Localizer& localizer) {
  return localizer.map().polar.key_blocks().full();
}

inline void ExpectSameAnswers(const Localizer& a, const Localizer& b) {
  Describer describer = *Describer::Create(ManyShifts());
  for (const char* method : {"a-pc", "pc-brute"}) {
    const Query query{.method = *ParseMethod(method), .num_candidates = 10, .max_answers = 5};
    for (std::uint32_t i = 0; i < kFullBlockPlaces + 60; i += 397) {
      const ScanDescriptor scan = describer.Describe(SmallScan(kFullBlockSeed + i));
      const auto answer = a.Localize(scan, query);
      ASSERT_TRUE(answer.ok()) << answer.status();
      ExpectSameAnswer(*answer, *b.Localize(scan, query));
    }
  }
}

}  // namespace scanloc::test
