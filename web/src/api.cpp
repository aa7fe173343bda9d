#include "api.hpp"

#include <cmath>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "api_asked.hpp"
#include "http_parts.hpp"
#include "json.hpp"
#include "scanloc/client/error_reason.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/report/map_use_text.hpp"

namespace scanloc::web {
namespace {

constexpr std::pair<absl::StatusCode, int> kHttpStatuses[] = {
    {absl::StatusCode::kInvalidArgument, 400},   {absl::StatusCode::kOutOfRange, 400},
    {absl::StatusCode::kUnauthenticated, 401},   {absl::StatusCode::kPermissionDenied, 403},
    {absl::StatusCode::kNotFound, 404},          {absl::StatusCode::kAborted, 409},
    {absl::StatusCode::kAlreadyExists, 409},     {absl::StatusCode::kFailedPrecondition, 409},
    {absl::StatusCode::kResourceExhausted, 429}, {absl::StatusCode::kUnimplemented, 501},
    {absl::StatusCode::kUnavailable, 503},       {absl::StatusCode::kDeadlineExceeded, 504}};
int HttpStatusOf(absl::StatusCode code) {
  for (const auto& [of, status] : kHttpStatuses) {
    if (of == code) return status;
  }
  return 500;
}

/// Names of the parameters behind the "?" that the document has.
std::set<std::string> QueryParameters(const std::string& method, const std::string& path) {
  static const Json document = Json::parse(kOpenApiDocument);
  std::set<std::string> names;
  const Json& operation = document.at("paths").at(path).at(absl::AsciiStrToLower(method));
  for (const Json& given : operation.value("parameters", Json::array())) {
    const std::string link = given.value("$ref", "#");
    const Json& parameter = link == "#" ? given : document.at(Json::json_pointer(link.substr(1)));
    if (parameter.at("in") == "query") names.insert(parameter.at("name"));
  }
  return names;
}

absl::Status CheckParameters(const Request& request, std::set<std::string> known) {
  const std::string all = known.empty() ? "none" : absl::StrJoin(known, ", ");
  for (const auto& [name, value] : request.parameters) {
    if (known.erase(name) > 0) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("the URL has a parameter \"", name.substr(0, 40),
                     "\" that is not known, or for the second time; known here: ", all));
  }
  return absl::OkStatus();
}

}  // namespace

Response ResponseTo(const absl::Status& status) {
  const int code = HttpStatusOf(status.code());
  Json error{{"code", absl::StatusCodeToString(status.code())},
             {"message", Printable(std::string(status.message()))}};
  if (std::string reason = client::ReasonOf(status); !reason.empty()) error["reason"] = reason;
  Response response{.status = code, .body = ToLine({{"error", error}}) + "\n"};
  if (const auto wait_s = client::RetryAfterOf(status)) {
    response.headers.emplace_back("Retry-After", absl::StrCat(std::ceil(*wait_s)));
  }
  if (code == 401) response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

Api::Api(Gateway& gateway) : gateway_(gateway) {
  Offer("GET", "/v1/maps", &Api::ListMaps);
  Offer("GET", "/v1/maps/{map}", &Api::GetMap);
  Offer("GET", "/v1/maps/{map}/places", &Api::ListPlaces);
  Offer("GET", "/v1/maps/{map}/places/{place}", &Api::GetPlace);
  Offer("GET", "/v1/maps/{map}/pairs", &Api::ListPairs);
  Offer("GET", "/v1/maps/{map}/use", &Api::GetUse);
  Offer("GET", "/v1/maps/{map}/tiles", &Api::ListTiles);
  Offer("GET", "/v1/maps/{map}/tiles/{tile}", &Api::GetTile);
  Offer("GET", "/v1/answers", &Api::ListAnswers);
  Offer("GET", "/v1/events", &Api::WatchAnswers);
  Offer("POST", "/v1/localize", &Api::Localize);
  Offer("GET", "/v1/health", &Api::Health);
  Offer("GET", "/v1/openapi.json", &Api::Document);
}

void Api::Offer(const char* method, const char* path, Act act) {
  routes_.push_back({.method = method,
                     .segments = absl::StrSplit(absl::string_view(path).substr(1), '/'),
                     .parameters = QueryParameters(method, path),
                     .act = act});
}

std::vector<std::string> Api::Routes() const {
  std::vector<std::string> all;
  for (const Route& route : routes_) {
    all.push_back(absl::StrCat(route.method, " /", absl::StrJoin(route.segments, "/")));
  }
  return all;
}

bool Api::TakesBody(const Request& request) {
  return request.method == "POST" && request.path == "/v1/localize";
}

Response Api::Handle(const Request& request) const {
  const std::vector<std::string> path =
      absl::StrSplit(absl::string_view(request.path).substr(1), '/');
  std::string allowed;
  for (const Route& route : routes_) {
    if (route.segments.size() != path.size()) continue;
    Asked asked{.request = request, .parts = {}, .client = nullptr};
    bool is_it = true;
    for (std::size_t i = 0; i < path.size() && is_it; ++i) {
      const std::string& segment = route.segments[i];
      if (segment.front() == '{') {
        asked.parts[segment.substr(1, segment.size() - 2)] = path[i];
      } else {
        is_it = segment == path[i];
      }
    }
    if (!is_it) continue;
    const bool is_read = request.method == "HEAD" && route.method == "GET";
    if (request.method != route.method && !is_read) {
      allowed = route.method;
      continue;
    }
    if (auto status = CheckParameters(request, route.parameters); !status.ok()) {
      return ResponseTo(status);
    }
    auto client = gateway_.As(request.token);
    if (!client.ok()) return ResponseTo(client.status());
    asked.client = *std::move(client);
    auto answer = (this->*route.act)(asked);
    return answer.ok() ? *std::move(answer) : ResponseTo(answer.status());
  }
  if (!allowed.empty()) {
    Response refused = ErrorResponse(405, "INVALID_ARGUMENT", "use " + allowed);
    refused.headers.emplace_back("Allow", allowed);
    return refused;
  }
  return ErrorResponse(404, "NOT_FOUND", "there is nothing here; see /v1/openapi.json");
}

Api::Answer Api::ListMaps(const Asked& asked) const {
  ASSIGN_OR_RETURN(const auto maps, asked.client->ListMaps());
  Json list = Json::array();
  for (const MapSummary& map : maps) list.push_back(ToJson(map));
  return Document200({{"maps", list}});
}

Api::Answer Api::GetMap(const Asked& asked) const {
  ASSIGN_OR_RETURN(const auto info, asked.client->GetMapInfo(asked.part("map")));
  return Document200(ToJson(info));
}

Api::Answer Api::ListPlaces(const Asked& asked) const {
  ASSIGN_OR_RETURN(const auto page,
                   asked.client->ListPlaces(asked.part("map"),
                                            asked.request.Parameter("page_token").value_or("")));
  return Document200(ToJson(page));
}

Api::Answer Api::GetPlace(const Asked& asked) const {
  ASSIGN_OR_RETURN(const auto index, ToNumber<std::int32_t>("place", asked.part("place")));
  ASSIGN_OR_RETURN(const auto place, asked.client->GetPlace(asked.part("map"), index));
  return Document200(ToJson(index, place));
}

Api::Answer Api::ListPairs(const Asked& asked) const {
  ASSIGN_OR_RETURN(const auto tiles, gateway_.TilesOf(*asked.client, asked.part("map")));
  ASSIGN_OR_RETURN(const auto pairs, asked.client->ListConfusablePairs(asked.part("map")));
  if (pairs.content_id != tiles->content_id()) {
    return absl::AbortedError("the map was replaced just now; ask again");
  }
  return Document200(ToJson(pairs, *tiles));
}

Api::Answer Api::GetUse(const Asked& asked) const {
  ASSIGN_OR_RETURN(const auto use, asked.client->GetMapUse(asked.part("map")));
  return Document200(report::MapUseToJson(use));
}

Api::Answer Api::ListTiles(const Asked& asked) const {
  ASSIGN_OR_RETURN(const auto tiles, gateway_.TilesOf(*asked.client, asked.part("map")));
  return Document200(ToJson(*tiles));
}

Api::Answer Api::GetTile(const Asked& asked) const {
  ASSIGN_OR_RETURN(const auto number, ToNumber<std::uint32_t>("tile", asked.part("tile")));
  ASSIGN_OR_RETURN(const auto tiles, gateway_.TilesOf(*asked.client, asked.part("map")));
  const auto content_id = asked.request.Parameter("content_id");
  if (content_id && *content_id != tiles->content_id()) {
    return absl::AbortedError("the map was replaced since its tiles were listed; begin anew");
  }
  if (number >= tiles->tiles().size()) {
    return absl::NotFoundError(absl::StrCat("the map has no tile ", number, "; it has ",
                                            tiles->tiles().size(), ", counted from 0"));
  }
  return Response{.content_type = "application/octet-stream",
                  .body = tiles->Rows(tiles->tiles()[number])};
}

Api::Answer Api::Health(const Asked& asked) const {
  const auto serving = asked.client->IsServing();
  const bool is_well = serving.ok() && *serving;
  Response response = Document200({{"serving", is_well}, {"server", gateway_.address()}});
  if (!is_well) response.status = 503;
  return response;
}

Api::Answer Api::Document(const Asked&) const {
  return Response{.body = std::string(kOpenApiDocument)};
}

}  // namespace scanloc::web
