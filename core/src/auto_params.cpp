#include "scanloc/core/auto_params.hpp"

#include <algorithm>

#include "scanloc/core/params.hpp"

namespace scanloc {
namespace {

void Scale(double scale, RegistrationParams& steps) {
  steps.wide_m *= scale;
  steps.narrow_m *= scale;
}

/// As scripts/fit_evidence.py --indoors fits them to rooms, halls, homes, offices and warehouses at
/// scale 0.35, rounded; bias and cohort_surely are more careful than what it would take
/// (docs/algorithm.md, "Confidence").
EvidenceParams IndoorEvidence() {
  EvidenceParams params;
  params.bias = -19.0;
  params.score = 17.6;
  params.sharpness = 20.0;
  params.over_mirror = 20.6;
  params.max_over_mirror = 0.25;  // of one wall a mirror image may have nothing
  params.contradicted = -40.0;
  params.chance = -29.7;
  params.inliers_share = 0.4;
  params.inliers = 12.8;
  params.rival = 250.0;
  params.equal_scores = 0.08;
  params.equal_by_chance = 0.15;
  params.beside = 250.0;
  params.alike_score = 0.85;
  params.equal_of_mirror = 0.5;
  params.cohort = 1.2;
  params.cohort_surely = 0.8;
  params.cohort_lead = 1.0;
  params.equal_in_cohort = 0.5;
  params.num_beside = 2;
  params.explaining_score = 0.55;
  params.sure_of_little = 1.0;
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
        &params.shortlist.aside_m, &params.verify.cutoff_m, &params.verify.coarse_cell_m,
        &params.verify.fine_cell_m, &params.verify.met_m, &params.verify.overlap_m,
        &params.verify.horizon_margin_m}) {
    *length_m *= scale;
  }
  Scale(scale, params.verify.first.steps);
  Scale(scale, params.verify.second.steps);
  Scale(scale, params.verify.at_once.steps);
  Scale(scale, params.verify.fine.steps);
  if (scale < 1.0) {
    // One aisle of twenty is not better than the others before all that stands there is looked at,
    // and a bay of one not before those beside it.
    params.shortlist.num_hypotheses = 600;
    params.verify.num_survivors = 400;
    params.verify.selection.num_hypotheses = 64;
    params.verify.heights_share = 0.8;
    params.verify.hopeless_by = 0.3;
    params.evidence = IndoorEvidence();
  }
  return params;
}

}  // namespace scanloc
