#include "scanloc/core/answer.hpp"

#include "scanloc/core/map/map.hpp"

namespace scanloc {

const char* OutcomeName(Outcome outcome) {
  switch (outcome) {
    case Outcome::kLocalized:
      return "localized";
    case Outcome::kAmbiguous:
      return "ambiguous";
    case Outcome::kNotRecognized:
      return "not_recognized";
    case Outcome::kInsufficientScan:
      return "insufficient_scan";
  }
  return "unknown";
}

Candidate CandidateOf(const Map& map, std::size_t place) {
  const Place& at = map.places[place];
  Candidate candidate;
  candidate.place = static_cast<std::int32_t>(place);
  candidate.matched = candidate.place;
  candidate.session = at.session;
  candidate.session_name = map.sessions[static_cast<std::size_t>(at.session)];
  candidate.T_map_place = at.T_map_place;
  candidate.T_map_query = at.T_map_place;
  return candidate;
}

void TellOfBase(const SensorMount& mount, Answer& answer) {
  for (Candidate& candidate : answer.candidates) {
    const Eigen::Vector3d lever_m =
        candidate.T_map_query.linear() * BaseInTurned(mount).translation();
    if (candidate.covariance) candidate.covariance = MovedBy(lever_m, *candidate.covariance);
    candidate.T_map_query = candidate.T_map_query * BaseInTurned(mount);
  }
}

}  // namespace scanloc
