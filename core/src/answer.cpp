#include "scanloc/core/answer.hpp"

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

}  // namespace scanloc
