#include "scanloc/core/auto_params.hpp"

#include <algorithm>

#include "scanloc/core/params.hpp"

namespace scanloc {
namespace {

void Scale(double scale, RegistrationParams& steps) {
  steps.wide_m *= scale;
  steps.narrow_m *= scale;
}

/// The weights of support as scripts/fit_evidence.py --wrong 6 gave them for rooms, halls, homes
/// and offices at scale 0.35, the bias lowered by 0.3; those of rivals, whose scores count heights,
/// chosen so that of 8,645 wrong answers in such worlds and warehouses all but one, on stairs, stay
/// below 0.75.
EvidenceParams IndoorEvidence() {
  EvidenceParams params;
  params.bias = -15.0;
  params.score = 17.5;
  params.sharpness = 14.5;
  params.over_mirror = 22.2;
  params.max_over_mirror = 0.25;  // of one wall a mirror image may have nothing
  params.contradicted = -4.4;
  params.chance = -31.0;
  params.rival = 60.0;
  params.equal_by_chance = 0.8;
  params.beside = 50.0;
  params.alike_score = 0.75;
  params.shared_in_a_row = 0.3;  // floors are alike in more than decks are
  return params;
}

}  // namespace

AutoParams AutoParamsAtScale(double scale) {
  AutoParams params;
  scale = std::clamp(scale, kMinScale, kMaxScale);
  if (scale == 1.0) return params;
  params.scale = scale;
  if (scale < 1.0) params.posts.voxel_m = scale * Params{}.voxel_size_m;
  for (double* length_m :
       {&params.posts.cell_m, &params.posts.reach_m, &params.posts.min_extent_m,
        &params.ground.reach_m, &params.ground.cell_m, &params.ground.wide_m,
        &params.ground.narrow_m, &params.shortlist.apart_m, &params.shortlist.bearing_ring_m,
        &params.verify.cutoff_m, &params.verify.coarse_cell_m, &params.verify.fine_cell_m,
        &params.verify.met_m, &params.verify.overlap_m, &params.verify.horizon_margin_m}) {
    *length_m *= scale;
  }
  Scale(scale, params.verify.first.steps);
  Scale(scale, params.verify.second.steps);
  Scale(scale, params.verify.at_once.steps);
  Scale(scale, params.verify.fine.steps);
  if (scale < 1.0) params.evidence = IndoorEvidence();
  return params;
}

}  // namespace scanloc
