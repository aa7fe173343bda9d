#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "checksum.hpp"
#include "scanloc/mapdb/map_builder.hpp"

namespace scanloc::mapdb {

/// Hash of a plan, by which a resumed build knows it again.
[[nodiscard]] std::string PlanHash(const SessionPlan& plan);

/// The same, scan by scan.
class PlanHasher {
 public:
  explicit PlanHasher(const std::string& name) { hasher_.Add("plan").Add(name); }
  void AddScan(const std::string& name, std::int64_t stamp_ns, std::span<const std::byte> pose) {
    hasher_.Add(name).Add(stamp_ns).Add(pose);
  }
  [[nodiscard]] std::string Hash() const { return hasher_.Digest128(); }

 private:
  Hasher hasher_;
};

/// Why the plan is not the one that a session was built of, as far as its committed places tell.
[[nodiscard]] std::string DescribeDifference(const SessionRow& stored,
                                             const std::vector<PlaceRow>& places,
                                             const SessionPlan& plan);

}  // namespace scanloc::mapdb
