#include "scanloc/mapdb/geo_origin.hpp"

#include <array>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "map_writer.hpp"
#include "scanloc/core/status_macros.hpp"
#include "schema.hpp"

namespace scanloc::mapdb {

std::string EncodeGeoOrigin(const GeoOrigin& origin) {
  std::string text;
  for (const double number :
       {origin.latitude_deg, origin.longitude_deg, origin.altitude_m, origin.heading_deg,
        origin.anchor_m.x(), origin.anchor_m.y(), origin.anchor_m.z()}) {
    absl::StrAppendFormat(&text, "%s%.17g", text.empty() ? "" : " ", number);
  }
  return text;
}

absl::StatusOr<GeoOrigin> DecodeGeoOrigin(const std::string& text) {
  const std::vector<std::string> words = absl::StrSplit(text, ' ');
  std::array<double, 7> numbers = {};
  bool is_good = words.size() == numbers.size();
  for (std::size_t i = 0; is_good && i < numbers.size(); ++i) {
    is_good = absl::SimpleAtod(words[i], &numbers[i]);
  }
  if (!is_good) return absl::InvalidArgumentError("geo origin: not seven numbers");
  GeoOrigin origin{
      numbers[0], numbers[1], numbers[2], numbers[3], {numbers[4], numbers[5], numbers[6]}};
  RETURN_IF_ERROR(scanloc::Validate(origin));
  return origin;
}

absl::Status SetGeoOrigin(const std::string& path, const GeoOrigin& origin) {
  RETURN_IF_ERROR(scanloc::Validate(origin));
  ASSIGN_OR_RETURN(MapWriter writer, MapWriter::Open(path));
  RETURN_IF_ERROR(writer.SetMeta(schema::kGeoOriginKey, EncodeGeoOrigin(origin)));
  return writer.Release();
}

}  // namespace scanloc::mapdb
