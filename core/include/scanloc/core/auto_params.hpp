#pragma once

#include <numbers>

namespace scanloc {

/// What of a scan is taken for a post, something upright seen from above. Shapes queries.
struct PostParams {
  double voxel_m = 0.0;   ///< voxels that posts are found in; 0: those of the contexts
  double cell_m = 0.5;    ///< cells of the plane that are looked at; one post a cell
  double reach_m = 60.0;  ///< posts farther off along x or y are left out: too few points a post
  double min_extent_m = 0.8;  ///< least height that a cell's points span: more than kerbs and steps

  friend bool operator==(const PostParams&, const PostParams&) = default;
};

/// The ground that levels a scan: a plane through the lowest points. Shapes queries.
struct GroundParams {
  double reach_m = 25.0;         ///< farther off the ground is hardly hit, and no longer one plane
  double cell_m = 2.0;           ///< of each cell of the plane the lowest point counts
  int min_cells = 12;            ///< with fewer there is no ground to be seen
  double low_share = 1.0 / 3.0;  ///< the quantile of their heights that the fit begins at
  double wide_m = 1.0;           ///< width of the weights in the first third of the steps ...
  double narrow_m = 0.3;         ///< ... and in the others: kerbs and slopes are ground, too
  double max_tilt_rad = 0.6;     ///< roll and pitch beyond are taken for a wall or a slope

  friend bool operator==(const GroundParams&, const GroundParams&) = default;
};

/// Places that may be the query's, and how it may lie on them.
struct ShortlistParams {
  /// Half of the places that every query looks at; more are looked at beside them, so that no
  /// rival drops out of a longer list. With 30 one hard query in fifty misses its own place.
  int num_places = 100;
  /// Signatures find this share of the map's places, within twice num_places and this many; those
  /// go on whose posts stand in the same directions.
  double found_share = 0.2;
  int max_found = 1500;  ///< of 20,000 places; of more, times the eighth root of how many more
  /// By how much more agreement makes up for twice the rank among the signatures.
  double agreement_per_octave = 0.02;
  double apart_m = 2.0;         ///< of places nearer to each other the better one goes first
  double bearing_ring_m = 4.0;  ///< rings of the bearing grid: as coarse as a pose may be off
  /// The query's directions are compared as from where it stands and from spots in steps of this,
  /// so many to either side: another lane is farther off than a ring is wide.
  double aside_m = 3.5;
  int num_asides = 2;
  int num_headings = 3;      ///< ways to lie on a place that the directions tell, at most
  int num_hypotheses = 240;  ///< of all places; those go on in which most agrees

  friend bool operator==(const ShortlistParams&, const ShortlistParams&) = default;
};

/// A registration of posts on a distance field: Gauss-Newton with Geman-McClure weights.
struct RegistrationParams {
  int num_iterations = 10;
  double wide_m = 1.5;    ///< width of the weights in the first step: as far as a guess is off ...
  double narrow_m = 0.7;  ///< ... and in the last, in even steps between
  /// Further steps at the narrow width until they become small: what still slides is no minimum.
  int max_settling = 0;

  friend bool operator==(const RegistrationParams&, const RegistrationParams&) = default;
};

/// A look at hypotheses: some posts, evenly taken, and how they are registered.
struct StageParams {
  int num_posts;
  RegistrationParams steps;

  friend bool operator==(const StageParams&, const StageParams&) = default;
};

/// Which hypotheses the fine stage looks at: of those nearer to each other than a spot's bounds,
/// few of each, so that a rival elsewhere, on another floor or turned gets its chance.
struct SelectionParams {
  int num_hypotheses = 16;
  int max_per_spot = 4;
  double spot_radius_m = 8.0;
  double spot_height_m = 1.0;
  double spot_heading_rad = std::numbers::pi / 4.0;

  friend bool operator==(const SelectionParams&, const SelectionParams&) = default;
};

/// From hypotheses to verified ones. The stages are measured on a town seen by 32 rays from two
/// lanes off, driving the other way: as many right as with all posts and steps for every one.
struct VerificationParams {
  double cutoff_m = 3.0;       ///< distances of fields end here: as far as a hypothesis is drawn
  double coarse_cell_m = 1.0;  ///< of the distance field of the coarse stages
  double fine_cell_m = 0.5;    ///< of those of the fine one
  StageParams first = {80, {3, 3.0, 2.4}};     ///< sees all hypotheses
  int num_survivors = 64;                      ///< of the first stage
  StageParams second = {250, {4, 2.2, 1.5}};   ///< sees those
  StageParams at_once = {250, {6, 3.0, 1.5}};  ///< for a hypothesis that is not one of many
  double hopeless_by = 0.2;   ///< with a score worse than the best by so much it is no rival
  double met_m = 0.5;         ///< as near to a better one of its place it is the same ...
  double met_rad = 0.1;       ///< ... if turned as it is, too
  SelectionParams selection;  ///< of the second stage, for the fine one
  StageParams fine = {300, {6, 1.5, 0.7, 12}};  ///< the query's posts; at last, all of them
  /// How well a post lies on another, exp(-½ (distance / this)²): noise, cells, other view.
  double overlap_m = 0.5;
  double horizon_margin_m = 2.0;  ///< beyond the farthest post in a direction still in sight
  /// Of a score, what counts what stands at the same heights; the rest, what stands at the same
  /// spots seen from above. 0: the heights of posts are not known (maps of schema 7 and before).
  double heights_share = 0.5;

  friend bool operator==(const VerificationParams&, const VerificationParams&) = default;
};

/// What else the best pose may be: looked at for every query.
struct RivalParams {
  double near_shift_m = 2.5;    ///< shifts that are tried: pillars stand at equal distances ...
  double far_shift_m = 4.5;     ///< ... seldom the same in two buildings
  double along_step_m = 3.0;    ///< ahead and behind along the way, in such steps ...
  double along_m = 24.0;        ///< ... as far as this, on the places that stand there
  double worth_a_look = 0.6;    ///< of the best score; with less a rival is not seen from nearer by
  double level_step_m = 1.5;    ///< floors are farther apart than two probes for them
  double above_radius_m = 3.0;  ///< places above and below that see the same lie within, in plan

  friend bool operator==(const RivalParams&, const RivalParams&) = default;
};

/// From what speaks for a pose to its confidence (docs/algorithm.md, "Confidence"). The weights are
/// fitted by scripts/fit_evidence.py on scans of many kinds.
struct EvidenceParams {
  int min_posts = 20;  ///< fewer, in cells of their own, fit on almost anything
  double bias = -11.2;
  double score = 15.0;
  double sharpness = 15.6;
  double max_sharpness = 0.2;  ///< beyond, more says no more
  double over_mirror = 17.8;
  double max_over_mirror = 0.3;  ///< likewise
  double contradicted = -4.2;
  double chance = -7.2;    ///< times 1/√posts
  double inlier_m = 0.05;  ///< off another's line by less, a post lies exactly on it
  /// Of the score that rivals are weighed by, what the share of such posts counts. 0: it is not
  /// looked at; outdoors what a scan has in common with other places never fits that exactly.
  double inliers_share = 0.0;
  double inliers = 0.0;          ///< log-odds of that share
  double max_inliers = 0.5;      ///< beyond, more says no more
  double least_inliers = 0.3;    ///< with fewer nothing speaks for the pose, and ...
  double beyond_inliers = 40.0;  ///< ... no more than this times what it has beyond
  double rival = 40.0;           ///< log-odds a score that is better by one
  double beside = 100.0;         ///< the same, against the pose itself 1 m or 10° off
  double equal_scores = 0.02;    ///< scores that differ by less, and by ...
  double equal_by_chance = 0.5;  ///< ... this times 1/√posts, are equal
  /// A rival that explains more than this of a scan is alike in all that stays: what tells it apart
  /// is loose things, which may stand right for either. Its score counts as more by this ...
  double alike_score = 0.65;
  double equal_of_alike = 1.0;  ///< ... times what it has beyond
  /// Of what a rival must be better by, what the place's mirror image must be: it is no other
  /// place, but what every place has in common with the next.
  double equal_of_mirror = 1.0;
  /// Two spots that explain so much of a scan are one thing too many, were it of neither.
  double explaining_score = 0.6;
  /// Log-odds of being better than a cohort, spots elsewhere in the map that are alike: who beats
  /// twenty aisles clearly was taken there. So much counts up to undecided, and ...
  double cohort = 0.0;
  double cohort_surely = 0.0;  ///< ... so much beyond. The spots explain ...
  double cohort_share = 0.7;   ///< ... at least this of what the best does; all of it counts ...
  int cohort_size = 6;         ///< ... where there are so many, nothing where there are half
  /// Where there are twice as many: log-odds, at most, of being ahead of all of them by more than
  /// is equal. What one aisle of many explains best by far is none that was not mapped.
  double cohort_lead = 0.0;
  /// Of what scores differ by that are equal, what remains where there are twice as many: all of it
  /// where there are cohort_size. What stands in alike aisles is many small things.
  double equal_in_cohort = 1.0;
  /// Where there is a cohort: places beside a spot's own that weigh it as one with that; each has
  /// its own view.
  int num_beside = 0;
  /// Most that the confidence is where only scores that may be equal by chance tell poses apart.
  double undecided = 0.799;
  /// And most that it is by one scan alone, but for who is at least so sure, where the place shows
  /// nothing in more than max_unseen of the directions (a map made by a sensor of 70° does not hold
  /// what it did not look at), or less than explaining_score is explained of a scan that does.
  double max_unseen = 0.5;
  double sure_of_little = 0.98;
  /// By how much scores differ that may be equal of spots that differ in height alone: what is seen
  /// of each floor depends on where a place of the map happens to be, on stairs most of all.
  double equal_floors = 0.15;
  double shared_in_a_row = 0.12;  ///< and by this: scans that follow each other share their errors
  double clear_m = 1.0;           ///< what stands before what is seen first is nearer by this ...
  double clear_share = 0.03;      ///< ... and by this share of the range, which a turn may move

  friend bool operator==(const EvidenceParams&, const EvidenceParams&) = default;
};

/// A robot that keeps moving: log-odds of its tracks, and how far they move unseen.
struct TrackParams {
  int num_supported = 4;           ///< spots of a scan that are looked at for more than scores
  double max_scan_log_odds = 6.0;  ///< of one scan: those that follow are alike, as are its errors
  double max_log_odds = 8.0;       ///< of a track
  double least_log_odds = -8.0;    ///< tracks less likely are given up
  double lost_log_odds = -2.0;     ///< a spot with less is none: its track has lost sight
  double sure_log_odds = 3.0;      ///< a track stays sure that is ahead of all others by so much
  double carried_penalty = 10.0;   ///< while a sure one is in sight, others begin so far behind ...
  double new_track_penalty = 4.0;  ///< ... and so far when it is lost by a robot that stands
  double doubt = 1.0;        ///< against a sure track, for each scan in a row that does not see it
  double doubt_alone = 4.0;  ///< likewise, where the scan alone says that it is elsewhere
  double equal_log_odds = 0.5;  ///< a sure track is seen where no other is ahead by more than this
  double far_log_odds = 4.0;    ///< against a track by a scan that is found too far from it
  double told_log_odds = 2.0;   ///< a scan that alone says where it is says so much against others;
                                ///< by as much more a track must be ahead to become sure
  double told_every_m = 1.0;    ///< way between two such scans
  double climb_m = 0.5;         ///< on a plane; who is found more above may be on other floors
  double standing_m = 0.05;     ///< from scan to scan; who goes less may be in a lift
  double fade_m = 30.0;         ///< way without sight in which a lead falls to 1/e
  double gate_m = 1.5;          ///< by odometry: how far off a track may be found ...
  double gate_per_metre = 0.1;  ///< ... and farther the longer the way was ...
  double gate_rad = 0.25;       ///< ... and how far turned
  double free_gate_rad = 0.75 * std::numbers::pi;  ///< without: less than half a turn
  double height_gate_m = 1.0;          ///< floors are farther apart than a track rises unseen ...
  double height_gate_per_metre = 0.1;  ///< ... but for so much of what it moves in the plane

  friend bool operator==(const TrackParams&, const TrackParams&) = default;
};

/// The numbers by which the method `auto` sees a scene, lays scans on it and judges them
/// (docs/algorithm.md, "Beyond the paper"), by stage; the defaults are those of a town or campus
/// seen by a vehicle. They belong to the map.
///
/// Not among them, for they are no matter of taste: numbers that a data structure is built of (64
/// sectors are the bits of a word, 15 rings, 72 sectors of a horizon, lanes of a block), limits
/// (Structure::kMaxPosts), what counts as right (PoseLimits), the damping and the number of steps
/// of fits that have converged long before, and the trials that a map is calibrated by
/// (calibrate.cpp).
struct AutoParams {
  /// Of the lengths of posts, ground, shortlist and verification to those of a town; told for
  /// people, the lengths themselves are what counts.
  double scale = 1.0;
  PostParams posts;
  GroundParams ground;
  ShortlistParams shortlist;
  VerificationParams verify;
  RivalParams rivals;
  EvidenceParams evidence;
  TrackParams track;

  friend bool operator==(const AutoParams&, const AutoParams&) = default;
};

inline constexpr double kMinScale = 0.1;
inline constexpr double kMaxScale = 4.0;

/// The defaults with the lengths of posts, ground, shortlist and verification times a scale in
/// [kMinScale, kMaxScale], which is clamped to it; below 1 posts are found in finer voxels, too.
[[nodiscard]] AutoParams AutoParamsAtScale(double scale);

}  // namespace scanloc
