#pragma once

#include "scanloc/core/auto_params.hpp"

namespace scanloc {

/// Calls visit(name, field, least, most) for every field, in a fixed order, with the range allowed.
/// A field is an int or double. Never rename one. P is AutoParams or const AutoParams.
template <typename P, typename Visitor>
void VisitAutoFields(P& params, Visitor&& visit) {
  visit("auto.scale", params.scale, kMinScale, kMaxScale);
  visit("auto.posts.voxel_m", params.posts.voxel_m, 0.0, 10.0);
  visit("auto.posts.cell_m", params.posts.cell_m, 0.05, 10.0);
  visit("auto.posts.reach_m", params.posts.reach_m, 2.0, 300.0);
  visit("auto.posts.min_extent_m", params.posts.min_extent_m, 0.02, 20.0);
  visit("auto.ground.reach_m", params.ground.reach_m, 1.0, 300.0);
  visit("auto.ground.cell_m", params.ground.cell_m, 0.1, 20.0);
  visit("auto.ground.min_cells", params.ground.min_cells, 3, 10000);
  visit("auto.ground.low_share", params.ground.low_share, 0.0, 0.9);
  visit("auto.ground.wide_m", params.ground.wide_m, 0.01, 10.0);
  visit("auto.ground.narrow_m", params.ground.narrow_m, 0.01, 10.0);
  visit("auto.ground.max_tilt_rad", params.ground.max_tilt_rad, 0.0, 1.5);
  visit("auto.shortlist.num_places", params.shortlist.num_places, 1, 10000);
  visit("auto.shortlist.found_share", params.shortlist.found_share, 0.0, 1.0);
  visit("auto.shortlist.max_found", params.shortlist.max_found, 1, 10000);
  visit("auto.shortlist.agreement_per_octave", params.shortlist.agreement_per_octave, 0.0, 1.0);
  visit("auto.shortlist.apart_m", params.shortlist.apart_m, 0.0, 50.0);
  visit("auto.shortlist.num_headings", params.shortlist.num_headings, 1, 16);
  visit("auto.shortlist.bearing_ring_m", params.shortlist.bearing_ring_m, 0.05, 50.0);
  visit("auto.shortlist.aside_m", params.shortlist.aside_m, 0.05, 50.0);
  visit("auto.shortlist.num_asides", params.shortlist.num_asides, 0, 8);
  visit("auto.shortlist.num_hypotheses", params.shortlist.num_hypotheses, 1, 100000);
  visit("auto.verify.cutoff_m", params.verify.cutoff_m, 0.05, 20.0);
  visit("auto.verify.coarse_cell_m", params.verify.coarse_cell_m, 0.05, 10.0);
  visit("auto.verify.fine_cell_m", params.verify.fine_cell_m, 0.05, 10.0);
  visit("auto.verify.first.num_posts", params.verify.first.num_posts, 1, 8192);
  visit("auto.verify.first.num_iterations", params.verify.first.steps.num_iterations, 1, 100);
  visit("auto.verify.first.wide_m", params.verify.first.steps.wide_m, 0.01, 50.0);
  visit("auto.verify.first.narrow_m", params.verify.first.steps.narrow_m, 0.01, 50.0);
  visit("auto.verify.num_survivors", params.verify.num_survivors, 1, 100000);
  visit("auto.verify.second.num_posts", params.verify.second.num_posts, 1, 8192);
  visit("auto.verify.second.num_iterations", params.verify.second.steps.num_iterations, 1, 100);
  visit("auto.verify.second.wide_m", params.verify.second.steps.wide_m, 0.01, 50.0);
  visit("auto.verify.second.narrow_m", params.verify.second.steps.narrow_m, 0.01, 50.0);
  visit("auto.verify.at_once.num_posts", params.verify.at_once.num_posts, 1, 8192);
  visit("auto.verify.at_once.num_iterations", params.verify.at_once.steps.num_iterations, 1, 100);
  visit("auto.verify.at_once.wide_m", params.verify.at_once.steps.wide_m, 0.01, 50.0);
  visit("auto.verify.at_once.narrow_m", params.verify.at_once.steps.narrow_m, 0.01, 50.0);
  visit("auto.verify.hopeless_by", params.verify.hopeless_by, 0.0, 1.0);
  visit("auto.verify.met_m", params.verify.met_m, 0.0, 50.0);
  visit("auto.verify.met_rad", params.verify.met_rad, 0.0, 3.2);
  visit("auto.verify.fine.num_posts", params.verify.fine.num_posts, 1, 8192);
  visit("auto.verify.fine.num_iterations", params.verify.fine.steps.num_iterations, 1, 100);
  visit("auto.verify.fine.wide_m", params.verify.fine.steps.wide_m, 0.01, 50.0);
  visit("auto.verify.fine.narrow_m", params.verify.fine.steps.narrow_m, 0.01, 50.0);
  visit("auto.verify.fine.max_settling", params.verify.fine.steps.max_settling, 0, 100);
  visit("auto.verify.selection.num_hypotheses", params.verify.selection.num_hypotheses, 1, 1000);
  visit("auto.verify.selection.max_per_spot", params.verify.selection.max_per_spot, 1, 1000);
  visit("auto.verify.selection.spot_radius_m", params.verify.selection.spot_radius_m, 0.1, 100.0);
  visit("auto.verify.selection.spot_height_m", params.verify.selection.spot_height_m, 0.1, 100.0);
  visit("auto.verify.selection.spot_heading_rad", params.verify.selection.spot_heading_rad, 0.05,
        3.2);
  visit("auto.verify.overlap_m", params.verify.overlap_m, 0.01, 10.0);
  visit("auto.verify.horizon_margin_m", params.verify.horizon_margin_m, 0.0, 50.0);
  visit("auto.verify.heights_share", params.verify.heights_share, 0.0, 1.0);
  visit("auto.rivals.near_shift_m", params.rivals.near_shift_m, 0.1, 50.0);
  visit("auto.rivals.far_shift_m", params.rivals.far_shift_m, 0.1, 50.0);
  visit("auto.rivals.along_step_m", params.rivals.along_step_m, 0.25, 50.0);
  visit("auto.rivals.along_m", params.rivals.along_m, 0.0, 100.0);
  visit("auto.rivals.worth_a_look", params.rivals.worth_a_look, 0.0, 1.0);
  visit("auto.rivals.level_step_m", params.rivals.level_step_m, 0.1, 50.0);
  visit("auto.rivals.above_radius_m", params.rivals.above_radius_m, 0.1, 50.0);
  visit("auto.evidence.min_posts", params.evidence.min_posts, 1, 8192);
  visit("auto.evidence.bias", params.evidence.bias, -1000.0, 1000.0);
  visit("auto.evidence.score", params.evidence.score, -1000.0, 1000.0);
  visit("auto.evidence.sharpness", params.evidence.sharpness, -1000.0, 1000.0);
  visit("auto.evidence.max_sharpness", params.evidence.max_sharpness, 0.0, 1.0);
  visit("auto.evidence.over_mirror", params.evidence.over_mirror, -1000.0, 1000.0);
  visit("auto.evidence.max_over_mirror", params.evidence.max_over_mirror, 0.0, 1.0);
  visit("auto.evidence.contradicted", params.evidence.contradicted, -1000.0, 1000.0);
  visit("auto.evidence.chance", params.evidence.chance, -1000.0, 1000.0);
  visit("auto.evidence.inlier_m", params.evidence.inlier_m, 0.001, 10.0);
  visit("auto.evidence.inliers_share", params.evidence.inliers_share, 0.0, 1.0);
  visit("auto.evidence.inliers", params.evidence.inliers, -1000.0, 1000.0);
  visit("auto.evidence.max_inliers", params.evidence.max_inliers, 0.0, 1.0);
  visit("auto.evidence.least_inliers", params.evidence.least_inliers, 0.0, 1.0);
  visit("auto.evidence.beyond_inliers", params.evidence.beyond_inliers, 0.0, 1000.0);
  visit("auto.evidence.rival", params.evidence.rival, 0.0, 1000.0);
  visit("auto.evidence.beside", params.evidence.beside, 0.0, 1000.0);
  visit("auto.evidence.equal_scores", params.evidence.equal_scores, 0.0, 1.0);
  visit("auto.evidence.equal_by_chance", params.evidence.equal_by_chance, 0.0, 10.0);
  visit("auto.evidence.alike_score", params.evidence.alike_score, 0.0, 1.0);
  visit("auto.evidence.equal_of_alike", params.evidence.equal_of_alike, 0.0, 10.0);
  visit("auto.evidence.explaining_score", params.evidence.explaining_score, 0.0, 1.0);
  visit("auto.evidence.cohort", params.evidence.cohort, 0.0, 1000.0);
  visit("auto.evidence.cohort_surely", params.evidence.cohort_surely, 0.0, 1000.0);
  visit("auto.evidence.cohort_share", params.evidence.cohort_share, 0.0, 1.0);
  visit("auto.evidence.cohort_size", params.evidence.cohort_size, 1, 1000);
  visit("auto.evidence.cohort_lead", params.evidence.cohort_lead, 0.0, 1000.0);
  visit("auto.evidence.equal_in_cohort", params.evidence.equal_in_cohort, 0.0, 1.0);
  visit("auto.evidence.num_beside", params.evidence.num_beside, 0, 8);
  visit("auto.evidence.undecided", params.evidence.undecided, 0.0, 1.0);
  visit("auto.evidence.max_unseen", params.evidence.max_unseen, 0.0, 1.0);
  visit("auto.evidence.sure_of_little", params.evidence.sure_of_little, 0.0, 1.0);
  visit("auto.evidence.equal_of_mirror", params.evidence.equal_of_mirror, 0.0, 1.0);
  visit("auto.evidence.equal_floors", params.evidence.equal_floors, 0.0, 1.0);
  visit("auto.evidence.shared_in_a_row", params.evidence.shared_in_a_row, 0.0, 1.0);
  visit("auto.evidence.clear_m", params.evidence.clear_m, 0.0, 50.0);
  visit("auto.evidence.clear_share", params.evidence.clear_share, 0.0, 0.9);
  visit("auto.track.num_supported", params.track.num_supported, 1, 1000);
  visit("auto.track.max_scan_log_odds", params.track.max_scan_log_odds, 0.1, 100.0);
  visit("auto.track.max_log_odds", params.track.max_log_odds, 0.1, 100.0);
  visit("auto.track.new_track_penalty", params.track.new_track_penalty, 0.0, 100.0);
  visit("auto.track.sure_log_odds", params.track.sure_log_odds, 0.0, 100.0);
  visit("auto.track.least_log_odds", params.track.least_log_odds, -100.0, 0.0);
  visit("auto.track.lost_log_odds", params.track.lost_log_odds, -100.0, 0.0);
  visit("auto.track.carried_penalty", params.track.carried_penalty, 0.0, 100.0);
  visit("auto.track.doubt", params.track.doubt, 0.0, 100.0);
  visit("auto.track.doubt_alone", params.track.doubt_alone, 0.0, 100.0);
  visit("auto.track.equal_log_odds", params.track.equal_log_odds, 0.0, 100.0);
  visit("auto.track.far_log_odds", params.track.far_log_odds, 0.0, 100.0);
  visit("auto.track.told_log_odds", params.track.told_log_odds, 0.0, 100.0);
  visit("auto.track.told_every_m", params.track.told_every_m, 0.0, 100.0);
  visit("auto.track.climb_m", params.track.climb_m, 0.0, 100.0);
  visit("auto.track.standing_m", params.track.standing_m, 0.0, 10.0);
  visit("auto.track.fade_m", params.track.fade_m, 0.1, 10000.0);
  visit("auto.track.gate_m", params.track.gate_m, 0.1, 100.0);
  visit("auto.track.gate_per_metre", params.track.gate_per_metre, 0.0, 1.0);
  visit("auto.track.gate_rad", params.track.gate_rad, 0.01, 3.2);
  visit("auto.track.free_gate_rad", params.track.free_gate_rad, 0.01, 3.2);
  visit("auto.track.height_gate_m", params.track.height_gate_m, 0.1, 100.0);
  visit("auto.track.height_gate_per_metre", params.track.height_gate_per_metre, 0.0, 1.0);
}

}  // namespace scanloc
