#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "scanloc/core/map/map.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::test {

inline bool SameEntries(const ContextTable& a, const ContextTable& b) {
  if (a.size() != b.size() || a.num_rows() != b.num_rows() || a.num_cols() != b.num_cols()) {
    return false;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    const ContextTable::Entry& x = a.entry(i);
    const ContextTable::Entry& y = b.entry(i);
    if (x.place != y.place || x.root_shift_m != y.root_shift_m || x.flipped != y.flipped ||
        x.augmented != y.augmented ||
        !std::ranges::equal(a.context(i).cells_cm, b.context(i).cells_cm) ||
        !std::ranges::equal(a.context(i).aligning_cm, b.context(i).aligning_cm) ||
        !std::ranges::equal(a.retrieval_key_cm(i), b.retrieval_key_cm(i))) {
      return false;
    }
  }
  return true;
}

inline bool SamePlace(const Place& a, const Place& b) {
  return a.T_map_place.matrix() == b.T_map_place.matrix() && a.stamp_ns == b.stamp_ns &&
         a.session == b.session;
}

/// Every bit that a map in memory holds, or what is not the same.
inline testing::AssertionResult SameMap(const Map& a, const Map& b) {
  if (a.params != b.params) return testing::AssertionFailure() << "params differ";
  if (a.content_id != b.content_id) return testing::AssertionFailure() << "content ids differ";
  if (a.sessions != b.sessions) return testing::AssertionFailure() << "sessions differ";
  if (!std::ranges::equal(a.places, b.places, SamePlace)) {
    return testing::AssertionFailure() << "places differ";
  }
  if (a.structures != b.structures) return testing::AssertionFailure() << "structures differ";
  if (a.bearings != b.bearings) return testing::AssertionFailure() << "bearings differ";
  if (a.calibration != b.calibration || a.confusable != b.confusable) {
    return testing::AssertionFailure() << "calibrations differ";
  }
  if (!SameEntries(a.polar, b.polar)) return testing::AssertionFailure() << "polar contexts differ";
  if (!SameEntries(a.cart, b.cart)) return testing::AssertionFailure() << "cart contexts differ";
  return testing::AssertionSuccess();
}

inline bool SameSession(const mapdb::SessionInfo& a, const mapdb::SessionInfo& b) {
  return a.name == b.name && a.num_scans == b.num_scans && a.num_places == b.num_places &&
         a.num_empty == b.num_empty && a.num_unreadable == b.num_unreadable &&
         a.first_stamp_ns == b.first_stamp_ns && a.last_stamp_ns == b.last_stamp_ns;
}

inline bool SameInfo(const mapdb::FileInfo& a, const mapdb::FileInfo& b) {
  return a.schema_version == b.schema_version && a.compatible_version == b.compatible_version &&
         a.built_by == b.built_by && a.content_id == b.content_id && a.complete == b.complete &&
         a.params == b.params && std::ranges::equal(a.sessions, b.sessions, SameSession) &&
         a.num_scans == b.num_scans && a.num_places == b.num_places && a.num_empty == b.num_empty &&
         a.num_unreadable == b.num_unreadable && a.first_stamp_ns == b.first_stamp_ns &&
         a.last_stamp_ns == b.last_stamp_ns && a.calibration == b.calibration &&
         a.confusable == b.confusable && a.extent_m.min() == b.extent_m.min() &&
         a.extent_m.max() == b.extent_m.max();
}

}  // namespace scanloc::test
