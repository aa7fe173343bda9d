#pragma once

#include <algorithm>
#include <string>
#include <type_traits>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/auto_fields.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/mapdb/map_builder.hpp"
#include "support/small_maps.hpp"

/// What the golden map files in tests/data hold; that of schema 1 without the structures. Never
/// change it: the files are compared with it.
namespace scanloc::test {

inline mapdb::SessionPlan GoldenPlan(const std::string& name, std::int64_t num_scans) {
  mapdb::SessionPlan plan;
  plan.name = name;
  for (std::int64_t i = 0; i < num_scans; ++i) {
    mapdb::PlannedScan scan;
    scan.name = name + "-" + std::to_string(i) + ".bin";
    scan.stamp_ns = 1'500'000'000'000'000'000 + i * 500'000'000;
    scan.T_map_place.translation() = Eigen::Vector3d(10.5 * static_cast<double>(i), -2.25, 0.125);
    if (i % 2 == 1) scan.T_map_place.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    plan.scans.push_back(scan);
  }
  return plan;
}

inline Context GoldenContext(int num_rows, int num_cols, int seed) {
  Context context{num_rows, num_cols, {}};
  for (int i = 0; i < num_rows * num_cols; ++i) {
    const int value = (seed * 997 + i * 131) % 1500;
    context.cells_cm.push_back(static_cast<std::uint16_t>(value % 3 == 0 ? 0 : value));
  }
  return context;
}

/// Of every schema: numbers of auto came with schema 3, and those of older maps are the defaults.
/// Those of later schemas are none that a fit may change.
inline Params GoldenParams(int version) {
  Params params = SmallParams();
  params.structure.enabled = version >= 2;
  if (version < 3) {
    params.automatic.verify.heights_share = 0.0;
    params.automatic.evidence.inliers_share = 0.0;
    params.automatic.evidence.equal_floors = 0.0;
    return params;
  }
  VisitAutoFields(params.automatic, [](const char*, auto& field, auto least, auto most) {
    field = std::clamp<std::decay_t<decltype(field)>>(1, least, most);
  });
  params.automatic.posts.reach_m = 61.25;
  params.automatic.ground.reach_m = 20.5;
  // What later versions brought.
  const AutoParams usual = AutoParamsAtScale(params.automatic.scale);
  if (version < 12) params.automatic.evidence.max_unseen = usual.evidence.max_unseen;
  if (version < 13) params.automatic.evidence.equal_of_mirror = usual.evidence.equal_of_mirror;
  if (version < 16) params.automatic.evidence.cohort_lead = 0.0;
  if (version < 15) params.automatic.evidence.sure_of_little = usual.evidence.sure_of_little;
  if (version < 14) {
    params.automatic.evidence.equal_in_cohort = 1.0;
    params.automatic.evidence.num_beside = 0;
  }
  if (version < 11) {
    ShortlistParams& shortlist = params.automatic.shortlist;
    shortlist.aside_m = usual.shortlist.aside_m;
    shortlist.num_asides = usual.shortlist.num_asides;
    shortlist.num_hypotheses = usual.shortlist.num_hypotheses;
  }
  if (version < 10) {
    EvidenceParams& evidence = params.automatic.evidence;
    evidence.cohort = usual.evidence.cohort;
    evidence.cohort_surely = usual.evidence.cohort_surely;
    evidence.cohort_share = usual.evidence.cohort_share;
    evidence.cohort_size = usual.evidence.cohort_size;
    evidence.undecided = usual.evidence.undecided;
    evidence.equal_floors = usual.evidence.equal_floors;
  }
  if (version < 9) {
    EvidenceParams& evidence = params.automatic.evidence;
    evidence.equal_floors = 0.0;
    evidence.inlier_m = usual.evidence.inlier_m;
    evidence.inliers_share = 0.0;
    evidence.inliers = usual.evidence.inliers;
    evidence.max_inliers = usual.evidence.max_inliers;
    evidence.least_inliers = usual.evidence.least_inliers;
    evidence.beyond_inliers = usual.evidence.beyond_inliers;
  }
  if (version < 8) {
    params.automatic.verify.heights_share = 0.0;
    params.automatic.evidence.explaining_score = usual.evidence.explaining_score;
  }
  if (version < 7) {
    params.automatic.evidence.beside = usual.evidence.beside;
    TrackParams& track = params.automatic.track;
    track.carried_penalty = usual.track.carried_penalty;
    track.doubt = usual.track.doubt;
    track.doubt_alone = usual.track.doubt_alone;
    track.equal_log_odds = usual.track.equal_log_odds;
    track.far_log_odds = usual.track.far_log_odds;
    track.told_log_odds = usual.track.told_log_odds;
    track.told_every_m = usual.track.told_every_m;
    track.climb_m = usual.track.climb_m;
    track.standing_m = usual.track.standing_m;
    track.fade_m = usual.track.fade_m;
  }
  if (version < 6) {
    ShortlistParams& shortlist = params.automatic.shortlist;
    shortlist.found_share = usual.shortlist.found_share;
    shortlist.max_found = usual.shortlist.max_found;
    shortlist.agreement_per_octave = usual.shortlist.agreement_per_octave;
    shortlist.apart_m = usual.shortlist.apart_m;
    params.automatic.rivals.along_m = usual.rivals.along_m;
    params.automatic.rivals.along_step_m = usual.rivals.along_step_m;
  }
  if (version < 4) {
    VerificationParams& verify = params.automatic.verify;
    verify.hopeless_by = usual.verify.hopeless_by;
    verify.met_m = usual.verify.met_m;
    verify.met_rad = usual.verify.met_rad;
    verify.fine.num_posts = usual.verify.fine.num_posts;
  }
  return params;
}

inline PlaceDescriptor GoldenDescriptor(int seed, int version) {
  const Params params = SmallParams();
  PlaceDescriptor descriptor;
  for (int v = 0; v < 3; ++v) {
    descriptor.polar.push_back(
        GoldenContext(params.polar.num_rings, params.polar.num_sectors, 3 * seed + v));
  }
  descriptor.cart = GoldenContext(params.cart.num_rows, params.cart.num_cols, 100 + seed);
  for (int i = 0; i < 10 * seed; ++i) {
    const auto x_cm = static_cast<std::int16_t>((seed * 7919 + i * 613) % 11999 - 5999);
    const auto y_cm = static_cast<std::int16_t>((seed * 104729 + i * 389) % 11999 - 5999);
    const std::uint32_t heights = version < 8 ? 0 : (1U << static_cast<unsigned>(i % 31)) | 1U;
    descriptor.structure.posts.push_back({x_cm, y_cm, heights});
  }
  descriptor.structure.roll_rad = 0.0078125F * static_cast<float>(seed);
  descriptor.structure.pitch_rad = -0.015625F * static_cast<float>(seed);
  descriptor.structure.height_m = 1.75F;
  descriptor.num_voxels = 1000 + static_cast<std::uint32_t>(seed);
  return descriptor;
}

/// Makes a map of two sessions: `morning` of 3 scans, the second one empty, and an unfinished
/// `evening` of which 1 of 2 scans is done. Gives its content id.
inline absl::Status MakeGoldenMap(const std::string& path) {
  auto morning = mapdb::MapBuilder::Create(path, GoldenParams(16), GoldenPlan("morning", 3));
  if (!morning.ok()) return morning.status();
  if (absl::Status status = morning->Add(GoldenDescriptor(0, 14)); !status.ok()) return status;
  if (absl::Status status = morning->Skip(mapdb::SkipReason::kEmpty); !status.ok()) return status;
  if (absl::Status status = morning->Add(GoldenDescriptor(1, 14)); !status.ok()) return status;
  if (absl::Status status = morning->Finish().status(); !status.ok()) return status;
  auto evening = mapdb::MapBuilder::Append(path, GoldenPlan("evening", 2));
  if (!evening.ok()) return evening.status();
  if (absl::Status status = evening->Add(GoldenDescriptor(2, 14)); !status.ok()) return status;
  return evening->Commit();
}

}  // namespace scanloc::test
