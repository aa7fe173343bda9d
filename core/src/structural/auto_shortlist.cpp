#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "scan/prefetch.hpp"
#include "scan/simd.hpp"
#include "scanloc/core/scan/bearing_grid.hpp"
#include "structural/auto_search.hpp"
#include "structural/stands.hpp"

// Which places a query may be of, by their signatures, and how it may lie on each, by the
// directions in which posts stand.

namespace scanloc {
namespace {

/// So many places are scored by two threads: half a millisecond of work, which a thread's 20 us are
/// worth. Maps of 200,000 places and more find as many.
constexpr int kLeastForTwo = 2'000;
/// How much of what agrees whichever way the query is turned does not count.
constexpr double kOfChance = 0.5;

/// How much a query agrees with each of a block's grids, over the root of what both have.
class AgreementScores {
 public:
  AgreementScores(const BearingBlock& places, const BearingQuery& query) {
    FindScale(places.ring_counts(), query.ring_counts(), of_chance_.data(), both_.data());
  }

  [[nodiscard]] double Of(std::size_t i, int count) const {
    return (count - of_chance_[i]) / both_[i];
  }

 private:
  using Scales = std::array<double, BearingBlock::kSize>;

  static void FindScale(const BearingBlock::RingCounts& places,
                        const BearingGrid::RingCounts& query, double* __restrict of_chance,
                        double* __restrict both);

  Scales of_chance_, both_;
};

SCANLOC_SIMD void AgreementScores::FindScale(const BearingBlock::RingCounts& places,
                                             const BearingGrid::RingCounts& query,
                                             double* __restrict of_chance,
                                             double* __restrict both) {
  int num_places[BearingBlock::kSize] = {};
  int in_all_turns[BearingBlock::kSize] = {};  // of each ring every sector meets every other once
  int num_query = 0;
  for (std::size_t ring = 0; ring < BearingGrid::kNumRings; ++ring) {
    num_query += query[ring];
    for (std::size_t i = 0; i < BearingBlock::kSize; ++i) {
      num_places[i] += places[ring][i];
      in_all_turns[i] += places[ring][i] * query[ring];
    }
  }
  for (std::size_t i = 0; i < BearingBlock::kSize; ++i) {
    of_chance[i] = kOfChance * in_all_turns[i] / static_cast<double>(BearingGrid::kNumSectors);
    const double product = static_cast<double>(num_places[i]) * num_query;
    both[i] = __builtin_sqrt(product < 1.0 ? 1.0 : product);
  }
}

/// Calls visit(some of those listed, their grids) until all were visited.
template <typename Listed, typename Visitor>
void VisitAtOnce(const Map& map, std::span<Listed> listed, Visitor&& visit) {
  const auto next_of = [&](std::span<Listed> rest) {
    return rest.first(std::min(BearingBlock::kSize, rest.size()));
  };
  while (!listed.empty()) {
    const std::span<Listed> block = next_of(listed);
    listed = listed.subspan(block.size());
    for (const Listed& here : next_of(listed)) {
      map.bearings.Prefetch(static_cast<std::size_t>(here.place));
    }
    BearingBlock grids;
    for (const Listed& here : block) grids.Add(map.bearings[static_cast<std::size_t>(here.place)]);
    visit(block, grids);
  }
}

/// How a query may lie on a place, as the directions from one of the spots say.
struct Guess {
  double score;
  std::size_t aside;  // number of the spot
  BearingTurn turn;
  std::int32_t place;

  /// Turned alike, and a step aside: registered, both end in one pose.
  [[nodiscard]] bool IsNextTo(const Guess& other) const {
    return std::max(aside, other.aside) - std::min(aside, other.aside) <= 1 &&
           turn.IsNextTo(other.turn);
  }
};

/// Adds the best guesses that are not next to better ones; of equal ones the first.
void AddBestApart(std::span<const Guess> guesses, std::size_t max_guesses,
                  std::vector<Guess>& best) {
  const std::size_t num_before = best.size();
  while (best.size() < num_before + max_guesses) {
    const Guess* next = nullptr;
    for (const Guess& guess : guesses) {
      if (next != nullptr && guess.score <= next->score) continue;
      const bool is_known =
          std::any_of(best.begin() + static_cast<std::ptrdiff_t>(num_before), best.end(),
                      [&](const Guess& better) { return guess.IsNextTo(better); });
      if (!is_known) next = &guess;
    }
    if (next == nullptr) break;
    best.push_back(*next);
  }
}

/// Leaves the best of the guesses, in their order; all that are as good as the last of them.
void KeepBest(std::size_t num_guesses, std::vector<Guess>& guesses) {
  if (guesses.size() <= num_guesses) return;
  std::vector<double> scores;
  scores.reserve(guesses.size());
  for (const Guess& guess : guesses) scores.push_back(guess.score);
  const auto last = scores.begin() + static_cast<std::ptrdiff_t>(num_guesses) - 1;
  std::nth_element(scores.begin(), last, scores.end(), std::greater<>());
  std::erase_if(guesses, [&](const Guess& guess) { return guess.score < *last; });
}

}  // namespace

std::vector<AutoSearch::Listed> AutoSearch::Retrieve(const SignatureQuery& query,
                                                     std::span<const Aside> asides, int num_usual,
                                                     int num_places,
                                                     const SearchControl& control) const {
  std::vector<std::vector<Listed>> of_spot(asides.size());
  int rank = 0;
  for (const auto& [place, spot] :
       signatures_.MostAlike(query, static_cast<std::size_t>(num_places), control)) {
    of_spot[spot].push_back({.place = place, .rank = rank, .is_usual = rank < num_usual});
    ++rank;
  }
  const double per_octave = map_.params.automatic.shortlist.agreement_per_octave;
  std::vector<Listed> listed;
  const auto score = [&](std::span<Listed> some, std::size_t spot) {
    const std::size_t first = std::max<std::size_t>(spot, 1) - 1;
    const std::size_t num_near = std::min(spot + 2, asides.size()) - first;
    VisitAtOnce(map_, some, [&](std::span<Listed> block, const BearingBlock& grids) {
      for (const Aside& aside : asides.subspan(first, num_near)) {
        const BlockCounts counts = aside.bearings.Count(grids);
        const AgreementScores scores(grids, aside.bearings);
        for (std::size_t i = 0; i < block.size(); ++i) {
          block[i].score = std::max(block[i].score, scores.Of(i, counts.MostOf(i)));
        }
      }
      for (Listed& here : block) here.score -= per_octave * std::log2(5.0 + here.rank);
    });
  };
  const auto score_part = [&](std::size_t part, std::size_t num_parts) {
    for (std::size_t spot = 0; spot < asides.size(); ++spot) {
      const std::span<Listed> all(of_spot[spot]);
      const std::size_t begin = part * all.size() / num_parts;
      score(all.subspan(begin, (part + 1) * all.size() / num_parts - begin), spot);
    }
  };
  if (rank < kLeastForTwo) {
    score_part(0, 1);
  } else {
    control.RunBoth([&] { score_part(0, 2); }, [&] { score_part(1, 2); });
  }
  for (const std::vector<Listed>& some : of_spot) {
    listed.insert(listed.end(), some.begin(), some.end());
  }
  return listed;
}

bool AutoSearch::IsBefore(const Listed& a, const Listed& b) {
  if (a.is_usual != b.is_usual) return a.is_usual;
  return a.score != b.score ? a.score > b.score : a.rank < b.rank;
}

std::vector<AutoSearch::Listed> AutoSearch::TakeApart(std::vector<Listed>& listed,
                                                      std::size_t num_places) const {
  constexpr std::size_t kAhead = 8;
  const double apart_m = map_.params.automatic.shortlist.apart_m;
  const auto pose_of = [&](const Listed& here) -> const Pose& {
    return map_.places[static_cast<std::size_t>(here.place)].T_map_place;
  };
  Stands stands;
  std::vector<Listed> taken;
  std::vector<Listed> left;
  // Most are not looked at: put in order as far as need be.
  const std::size_t num_at_once = 2 * num_places + kAhead;
  std::size_t num_ordered = 0;
  for (std::size_t i = 0; i < listed.size(); ++i) {
    if (i + kAhead >= num_ordered && num_ordered < listed.size()) {
      const auto begin = listed.begin() + static_cast<std::ptrdiff_t>(num_ordered);
      num_ordered = std::min(num_ordered + num_at_once, listed.size());
      const auto end = listed.begin() + static_cast<std::ptrdiff_t>(num_ordered);
      std::nth_element(begin, end - 1, listed.end(), IsBefore);
      std::sort(begin, end, IsBefore);
    }
    if (taken.size() == num_places) {
      left.insert(left.end(), listed.begin() + static_cast<std::ptrdiff_t>(i), listed.end());
      break;
    }
    if (i + kAhead < listed.size()) Prefetch(&pose_of(listed[i + kAhead]), sizeof(Pose));
    const Pose& pose = pose_of(listed[i]);
    const bool is_known = stands.IsAnyBeside(pose, apart_m);
    if (!is_known) stands.Add(pose);
    (is_known ? left : taken).push_back(listed[i]);
  }
  const auto num_more =
      static_cast<std::ptrdiff_t>(std::min(left.size(), num_places - taken.size()));
  taken.insert(taken.end(), left.begin(), left.begin() + num_more);
  left.erase(left.begin(), left.begin() + num_more);
  listed = std::move(left);
  return taken;
}

std::array<std::vector<AutoSearch::Listed>, 2> AutoSearch::List(
    const SignatureQuery& query, std::span<const Aside> asides, int shortlist,
    const SearchControl& control) const {
  const ShortlistParams& params = map_.params.automatic.shortlist;
  const auto num_usual = static_cast<int>(NumToFind(params, map_.places.size()));
  std::vector<Listed> listed =
      Retrieve(query, asides, num_usual, std::max(2 * shortlist, num_usual), control);
  const auto unusual = std::partition(listed.begin(), listed.end(),
                                      [](const Listed& here) { return here.is_usual; });
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

std::vector<Hypothesis> AutoSearch::GuessesOn(std::span<const Listed> listed,
                                              std::span<const Aside> asides,
                                              std::size_t num_guesses) const {
  const auto max_of_place = static_cast<std::size_t>(map_.params.automatic.shortlist.num_headings);
  std::vector<Guess> guesses;
  std::array<std::vector<Guess>, BearingBlock::kSize> found;
  VisitAtOnce(map_, listed, [&](std::span<const Listed> block, const BearingBlock& grids) {
    for (std::vector<Guess>& of_place : found) of_place.clear();
    for (std::size_t aside = 0; aside < asides.size(); ++aside) {
      const BlockCounts counts = asides[aside].bearings.Count(grids);
      const AgreementScores scores(grids, asides[aside].bearings);
      counts.VisitBest(max_of_place, [&](std::size_t i, const BearingTurn& turn) {
        found[i].push_back({scores.Of(i, turn.count), aside, turn, block[i].place});
      });
    }
    for (std::size_t i = 0; i < block.size(); ++i) AddBestApart(found[i], max_of_place, guesses);
  });
  KeepBest(num_guesses, guesses);
  std::vector<Hypothesis> hypotheses;
  hypotheses.reserve(guesses.size());
  for (const Guess& guess : guesses) {
    const double yaw_rad = guess.turn.heading_rad();
    const double left_m = asides[guess.aside].left_m;
    hypotheses.push_back({guess.place,
                          {-std::sin(yaw_rad) * left_m, std::cos(yaw_rad) * left_m, yaw_rad},
                          guess.score});
  }
  return hypotheses;
}

std::array<std::vector<Hypothesis>, 2> AutoSearch::Propose(const ScanDescriptor& query,
                                                           int shortlist, PayloadView& payload,
                                                           const SearchControl& control,
                                                           StageTimes& times) const {
  const std::int64_t start_ns = control.Now_ns();
  const ShortlistParams& params = map_.params.automatic.shortlist;
  const std::vector<BearingGrid> spots = SpotsOf(query.structure.posts, params);
  std::vector<Aside> asides;
  for (int i = -params.num_asides; i <= params.num_asides; ++i) {
    asides.push_back({i * params.aside_m, BearingQuery(spots[asides.size()])});
  }
  const std::array<std::vector<Listed>, 2> parts =
      List(signatures_.QueryOf(spots, query.polar, query.cart), asides, shortlist, control);
  const std::int64_t retrieved_ns = control.Now_ns();
  std::array<std::vector<Hypothesis>, 2> proposed;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    // As many of a longer list as of the usual one.
    const double share =
        static_cast<double>(parts[part].size()) / std::max<double>(1.0, 2.0 * params.num_places);
    const double num_guesses = std::ceil(params.num_hypotheses * std::max(share, 1.0));
    proposed[part] = GuessesOn(parts[part], asides, static_cast<std::size_t>(num_guesses));
    for (Hypothesis& guess : proposed[part]) {
      guess.is_usual = part == 0;
      payload.WillUseStructure(static_cast<std::size_t>(guess.place));
    }
  }
  payload.Fetch();
  for (std::vector<Hypothesis>& part : proposed) {
    // What was not read: the time was over.
    std::erase_if(part, [&](const Hypothesis& guess) {
      return !payload.HasStructure(static_cast<std::size_t>(guess.place));
    });
  }
  times.retrieve_ns = retrieved_ns - start_ns;
  times.match_ns = control.Now_ns() - retrieved_ns;
  return proposed;
}

}  // namespace scanloc
