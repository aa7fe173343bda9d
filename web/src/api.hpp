#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "gateway.hpp"
#include "http_server.hpp"

namespace scanloc::web {

/// openapi.json, as it was when this was built.
extern const std::string_view kOpenApiDocument;

/// What scanloc-web answers over HTTP (docs/web.md, openapi.json), by asking the server as whoever
/// asks here. Thread-safe.
class Api {
 public:
  explicit Api(Gateway& gateway);

  /// Any request; what is no part of the interface gets a document that says so.
  [[nodiscard]] Response Handle(const Request& request) const;

  /// Whether the request may have a body.
  [[nodiscard]] static bool TakesBody(const Request& request);

  /// "GET /v1/maps/{map}" and so on: all there is, for the tests of the document.
  [[nodiscard]] std::vector<std::string> Routes() const;

 private:
  /// One request on its way.
  struct Asked;
  using Answer = absl::StatusOr<Response>;
  using Act = Answer (Api::*)(const Asked&) const;
  struct Route {
    std::string method;
    std::vector<std::string> segments;  ///< "{name}" stands for any one
    std::set<std::string> parameters;   ///< that there may be behind the "?"
    Act act;
  };

  /// What the document has.
  void Offer(const char* method, const char* path, Act act);

  [[nodiscard]] Answer ListMaps(const Asked& asked) const;
  [[nodiscard]] Answer GetMap(const Asked& asked) const;
  [[nodiscard]] Answer ListPlaces(const Asked& asked) const;
  [[nodiscard]] Answer GetPlace(const Asked& asked) const;
  [[nodiscard]] Answer ListPairs(const Asked& asked) const;
  [[nodiscard]] Answer GetUse(const Asked& asked) const;
  [[nodiscard]] Answer ListTiles(const Asked& asked) const;
  [[nodiscard]] Answer GetTile(const Asked& asked) const;
  [[nodiscard]] Answer ListAnswers(const Asked& asked) const;
  [[nodiscard]] Answer WatchAnswers(const Asked& asked) const;
  [[nodiscard]] Answer Localize(const Asked& asked) const;
  [[nodiscard]] Answer Health(const Asked& asked) const;
  [[nodiscard]] Answer Document(const Asked& asked) const;

  Gateway& gateway_;
  std::vector<Route> routes_;
};

/// The status as an HTTP response with the document of an error.
[[nodiscard]] Response ResponseTo(const absl::Status& status);

}  // namespace scanloc::web
