#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace scanloc::report {

/// How good an answer is.
enum class Verdict {
  kRight,
  kWrong,
  kUnchecked,      ///< localized, but the truth is not known
  kAmbiguous,      ///< two places or more explain the scan
  kNotRecognized,  ///< or the scan shows too little
};

/// One query in the picture; positions in the plane of the map frame [m].
struct PicturedQuery {
  std::string query;
  Verdict verdict = Verdict::kNotRecognized;
  std::optional<Eigen::Vector2d> answered;  ///< where the answer says it was
  std::optional<Eigen::Vector2d> truth;     ///< where it was
};

/// One place in the picture.
struct PicturedPlace {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  std::size_t session = 0;
};

/// Where the path through the places begins anew: at the first, at those of another session and
/// after jumps, where the vehicle was elsewhere. Ascending.
[[nodiscard]] std::vector<std::size_t> StretchStarts(const std::vector<PicturedPlace>& places);

/// A map and its answers as one SVG document, seen from above, x to the right and y up: the places
/// as a path, and nothing else where there are no queries; a blue dot where a right answer lies; a
/// vermilion cross where a wrong one lies, with a line to the true position; a sky blue diamond for
/// one that cannot be checked; an orange triangle at the best guess of an ambiguous one; a grey
/// square at the true position of a query that was not recognised.
[[nodiscard]] std::string DrawMapPicture(const std::string& title,
                                         const std::vector<PicturedPlace>& places,
                                         const std::vector<PicturedQuery>& queries);

}  // namespace scanloc::report
