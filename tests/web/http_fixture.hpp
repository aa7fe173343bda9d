#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "api.hpp"
#include "http_server.hpp"
#include "json.hpp"
#include "support/small_map.hpp"
#include "support/tcp_connection.hpp"
#include "support/temp_dir.hpp"
#include "support/test_server.hpp"

namespace scanloc::web {

/// What an HTTP server said.
struct Said {
  int status = 0;
  std::string header;
  std::string body;

  [[nodiscard]] Json json() const { return Json::parse(body, nullptr, false); }
};

inline Said Parse(const std::string& text) {
  Said said;
  const std::size_t end = text.find("\r\n\r\n");
  if (text.size() < 12 || end == std::string::npos) return said;
  said.status = std::stoi(text.substr(9, 3));
  said.header = text.substr(0, end);
  said.body = text.substr(end + 4);
  return said;
}

/// A request in bytes, after which the connection ends.
inline std::string RequestText(const std::string& method, const std::string& target,
                               const std::string& body = "", const std::string& headers = "") {
  std::string text = absl::StrCat(method, " ", target, " HTTP/1.1\r\nHost: localhost\r\n",
                                  "Connection: close\r\n", headers);
  if (!body.empty()) absl::StrAppend(&text, "Content-Length: ", body.size(), "\r\n");
  return absl::StrCat(text, "\r\n", body);
}

/// A scanlocd's service in the test, and the interface before it.
class HttpTest : public testing::Test {
 protected:
  static constexpr int kNumPlaces = 12;

  void StartServer(int recent_answers = 100, const std::string& token_file = "") {
    Map map = test::SmallMap(1, kNumPlaces);
    map.geo_origin = GeoOrigin{48.0, 11.0, 500.0};
    map.confusable = {{.place = 2, .lookalike = 9, .confidence = 0.5}};
    maps_ = {{"town", std::move(map)}};
    server::ServerOptions options = test::OptionsFor(maps_);
    options.maps.front().path = dir_.File("town");
    options.map_health_s = 3600.0;
    options.recent_answers = recent_answers;
    options.token_file = token_file;
    server_ = test::StartServer(maps_, options);
  }

  /// At a free port of 127.0.0.1, unless the options listen elsewhere.
  void StartWeb(HttpOptions options = {}) {
    if (options.listen == HttpOptions().listen) options.listen = "127.0.0.1:0";
    if (server_ == nullptr) StartServer();
    gateway_ = std::make_unique<Gateway>(client::ClientOptions{.address = server_->address()});
    api_ = std::make_unique<Api>(*gateway_);
    auto web = HttpServer::Start(options, Api::TakesBody,
                                 [this](const Request& request) { return api_->Handle(request); });
    ASSERT_TRUE(web.ok()) << web.status();
    web_ = *std::move(web);
    address_ = "127.0.0.1" + web_->url().substr(web_->url().rfind(':'));
  }

  [[nodiscard]] Said Ask(const std::string& bytes) const {
    const test::TcpConnection connection(address_);
    connection.Send(bytes);
    return Parse(connection.ReadAll());
  }
  [[nodiscard]] Said Get(const std::string& target, const std::string& headers = "") const {
    return Ask(RequestText("GET", target, "", headers));
  }

  test::TempDir dir_;
  test::Maps maps_;
  std::unique_ptr<server::Server> server_;
  std::unique_ptr<Gateway> gateway_;
  std::unique_ptr<Api> api_;
  std::unique_ptr<HttpServer> web_;
  std::string address_;
};

/// The bytes of a KITTI file of the points.
inline std::string KittiBytes(const PointCloud& points) {
  std::string bytes;
  for (const Point& point : points) {
    const float row[4] = {point.x, point.y, point.z, 0.5F};
    bytes.append(reinterpret_cast<const char*>(row), sizeof row);
  }
  return bytes;
}

}  // namespace scanloc::web
