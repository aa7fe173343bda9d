#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "scanloc/core/scan_context/match.hpp"
#include "structural/auto_search.hpp"

// Which places a query may be of, and how it may lie on each: by the keys of both kinds of context,
// and of what they find by the bearings of what stands there.

namespace scanloc {
namespace {

constexpr double kAlikeHeading = 0.7;  // cosine of what two places may look apart
/// How much of what agrees whichever way the query is turned does not count.
constexpr double kOfChance = 0.5;

/// How well a place's bearings agree with a query's in the best heading, over the root of what both
/// have.
double BestAgreement(const BearingGrid& place, const TurnedBearings& query) {
  const BearingGrid::Agreement agreement = place.AgreementByTurn(query);
  const int most = *std::max_element(agreement.begin(), agreement.end());
  const int all = std::accumulate(agreement.begin(), agreement.end(), 0);
  const double seen = static_cast<double>(place.num_sectors()) * query.num_sectors();
  return (most - kOfChance * all / BearingGrid::kNumSectors) / std::sqrt(std::max(seen, 1.0));
}

/// One retrieved entry's relative pose by its aligning key: a polar column is a turn, a cart column
/// a lateral displacement.
PlanarPose PolarGuess(const ContextTable& table, const ContextView& query, std::size_t entry,
                      const ContextView& context) {
  const int shift = PreAlign(query, context, {ShiftMode::kCircular});
  const double sector_rad = 2.0 * std::numbers::pi / table.num_cols();
  return {0.0, table.entry(entry).root_shift_m, WrapAngle(shift * sector_rad)};
}

PlanarPose CartGuess(const ContextTable& table, const CartParams& params, const ContextView& query,
                     std::size_t entry, const ContextView& context) {
  const int shift = PreAlign(query, context, {ShiftMode::kBounded, params.max_shift_cols});
  const double lateral_m = shift * 2.0 * params.max_y_m / params.num_cols;
  return table.entry(entry).flipped ? PlanarPose{0.0, -lateral_m, std::numbers::pi}
                                    : PlanarPose{0.0, lateral_m, 0.0};
}

}  // namespace

std::vector<AutoSearch::Listed> AutoSearch::Retrieve(const Keys& polar_keys, const Keys& cart_keys,
                                                     const TurnedBearings& bearings, int num_usual,
                                                     int num_places,
                                                     const SearchControl& control) const {
  std::vector<Listed> listed;
  absl::flat_hash_map<std::int32_t, std::size_t> slots;
  // Where places are excluded, the nearest of the others may be anywhere.
  const KeyEffort effort =
      control.excluded == nullptr ? EffortFor(map_.places.size(), num_places) : KeyEffort();
  const auto add = [&](const KeyIndex* index, const ContextTable& table, const Keys& keys,
                       std::optional<std::size_t> Listed::*entry_of) {
    if (index == nullptr) return;
    const auto found = index->Search(keys.retrieval_cm, num_places, true, control.excluded, effort);
    for (std::size_t rank = 0; rank < found.size(); ++rank) {
      const std::int32_t place = table.entry(found[rank].entry).place;
      const auto [slot, is_new] = slots.try_emplace(place, listed.size());
      if (is_new) listed.push_back({.place = place, .rank = static_cast<int>(rank)});
      Listed& here = listed[slot->second];
      here.rank = std::min(here.rank, static_cast<int>(rank));
      here.*entry_of = found[rank].entry;
    }
  };
  add(polar_.get(), map_.polar, polar_keys, &Listed::polar_entry);
  add(cart_.get(), map_.cart, cart_keys, &Listed::cart_entry);
  const double per_octave = map_.params.automatic.shortlist.agreement_per_octave;
  for (Listed& here : listed) {
    here.score = BestAgreement(map_.bearings[static_cast<std::size_t>(here.place)], bearings) -
                 per_octave * std::log2(5.0 + here.rank);
    here.is_usual = here.rank < num_usual;
  }
  std::stable_sort(listed.begin(), listed.end(), [](const Listed& a, const Listed& b) {
    return std::pair(!a.is_usual, -a.score) < std::pair(!b.is_usual, -b.score);
  });
  return listed;
}

std::vector<AutoSearch::Listed> AutoSearch::TakeApart(std::vector<Listed>& listed,
                                                      std::size_t num_places) const {
  const double apart_m = map_.params.automatic.shortlist.apart_m;
  struct Stand {
    Eigen::Vector3d position_m;
    Eigen::Vector3d ahead;
  };
  std::vector<Stand> stands;
  std::vector<Listed> taken;
  std::vector<Listed> left;
  for (const Listed& here : listed) {
    if (taken.size() == num_places) {
      left.push_back(here);
      continue;
    }
    const Pose pose = T_map_level(static_cast<std::size_t>(here.place));
    const Stand stand{pose.translation(), pose.linear().col(0)};
    // A place that looks the other way sees other things.
    const bool is_known = std::any_of(stands.begin(), stands.end(), [&](const Stand& other) {
      return (stand.position_m - other.position_m).norm() < apart_m &&
             stand.ahead.dot(other.ahead) > kAlikeHeading;
    });
    if (!is_known) stands.push_back(stand);
    (is_known ? left : taken).push_back(here);
  }
  const auto num_more =
      static_cast<std::ptrdiff_t>(std::min(left.size(), num_places - taken.size()));
  taken.insert(taken.end(), left.begin(), left.begin() + num_more);
  left.erase(left.begin(), left.begin() + num_more);
  listed = std::move(left);
  return taken;
}

std::array<std::vector<AutoSearch::Listed>, 2> AutoSearch::List(
    const Keys& polar_keys, const Keys& cart_keys, const TurnedBearings& bearings, int shortlist,
    const SearchControl& control) const {
  const ShortlistParams& params = map_.params.automatic.shortlist;
  const double share = params.found_share * static_cast<double>(map_.places.size());
  const int num_usual =
      std::max(params.num_places, static_cast<int>(std::min<double>(params.max_found, share)));
  std::vector<Listed> listed =
      Retrieve(polar_keys, cart_keys, bearings, num_usual, std::max(shortlist, num_usual), control);
  const auto unusual =
      std::find_if(listed.begin(), listed.end(), [](const Listed& here) { return !here.is_usual; });
  const std::vector<Listed> further(unusual, listed.end());
  listed.erase(unusual, listed.end());
  const auto num_places = 2 * static_cast<std::size_t>(params.num_places);
  std::array<std::vector<Listed>, 2> parts;
  parts[0] = TakeApart(listed, num_places);
  if (shortlist > params.num_places) {
    listed.insert(listed.end(), further.begin(), further.end());
    parts[1] = TakeApart(listed, 2 * static_cast<std::size_t>(shortlist) - num_places);
  }
  return parts;
}

std::vector<Hypothesis> AutoSearch::GuessesOn(const Listed& here, const ContextView& polar,
                                              const ContextView& cart,
                                              const TurnedBearings& bearings,
                                              PayloadView& payload) const {
  std::vector<Hypothesis> guesses;
  const auto add = [&](const PlanarPose& T_place_query) {
    const Hypothesis guess{here.place, T_place_query};
    if (!HasMet(guess, guesses, map_.params.automatic.verify)) guesses.push_back(guess);
  };
  if (here.polar_entry) {
    add(PolarGuess(map_.polar, polar, *here.polar_entry,
                   payload.Context(DescriptorKind::kPolar, *here.polar_entry)));
  }
  if (here.cart_entry) {
    add(CartGuess(map_.cart, map_.params.cart, cart, *here.cart_entry,
                  payload.Context(DescriptorKind::kCart, *here.cart_entry)));
  }
  const BearingGrid& place = map_.bearings[static_cast<std::size_t>(here.place)];
  for (const double yaw_rad : BearingGrid::BestHeadings(
           place.AgreementByTurn(bearings), map_.params.automatic.shortlist.num_headings)) {
    add({0.0, 0.0, yaw_rad});
  }
  return guesses;
}

std::array<std::vector<Hypothesis>, 2> AutoSearch::Propose(const ScanDescriptor& query,
                                                           int shortlist, PayloadView& payload,
                                                           const SearchControl& control,
                                                           StageTimes& times) const {
  const auto view = [](const Context& context, const Keys& keys) {
    return ContextView{context.num_rows, context.num_cols, context.cells_cm, keys.aligning_cm};
  };
  const std::int64_t start_ns = control.Now_ns();
  const Keys polar_keys = polar_ ? MakeKeys(query.polar) : Keys{};
  const Keys cart_keys = cart_ ? MakeKeys(query.cart) : Keys{};
  const TurnedBearings bearings(
      BearingGrid(query.structure.posts, map_.params.automatic.shortlist.bearing_ring_m));
  const std::array<std::vector<Listed>, 2> parts =
      List(polar_keys, cart_keys, bearings, shortlist, control);
  const std::int64_t retrieved_ns = control.Now_ns();
  for (const std::vector<Listed>& part : parts) {
    for (const Listed& here : part) {
      if (here.polar_entry) payload.WillUse(DescriptorKind::kPolar, *here.polar_entry);
      if (here.cart_entry) payload.WillUse(DescriptorKind::kCart, *here.cart_entry);
      payload.WillUseStructure(static_cast<std::size_t>(here.place));
    }
  }
  payload.Fetch();
  std::array<std::vector<Hypothesis>, 2> proposed;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    for (const Listed& here : parts[part]) {
      // Read last of what is looked at here: without it the time was over.
      if (!payload.HasStructure(static_cast<std::size_t>(here.place))) continue;
      std::vector<Hypothesis> guesses = GuessesOn(here, view(query.polar, polar_keys),
                                                  view(query.cart, cart_keys), bearings, payload);
      for (Hypothesis& guess : guesses) guess.is_usual = part == 0;
      proposed[part].insert(proposed[part].end(), guesses.begin(), guesses.end());
    }
  }
  times.retrieve_ns = retrieved_ns - start_ns;
  times.match_ns = control.Now_ns() - retrieved_ns;
  return proposed;
}

}  // namespace scanloc
