// The interface as somebody with curl sees it.
#include <cmath>

#include "http_fixture.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::web {
namespace {

using ::testing::HasSubstr;

class ApiTest : public HttpTest {};

TEST_F(ApiTest, TellsOfMaps) {
  StartWeb();
  const Said maps = Get("/v1/maps");
  EXPECT_EQ(maps.status, 200);
  EXPECT_EQ(maps.json()["maps"][0]["name"], "town");
  const Json info = Get("/v1/maps/town").json();
  EXPECT_EQ(info["num_places"], kNumPlaces);
  EXPECT_EQ(info["sessions"], Json({"morning", "evening"}));
  const Said none = Get("/v1/maps/nowhere");
  EXPECT_EQ(none.status, 404);
  EXPECT_EQ(none.json()["error"]["code"], "NOT_FOUND");
}

TEST_F(ApiTest, TellsOfPlacesAndWhatTheyHold) {
  StartWeb();
  const Json page = Get("/v1/maps/town/places").json();
  EXPECT_EQ(page["places"].size(), static_cast<std::size_t>(kNumPlaces));
  EXPECT_EQ(page["places"][3]["place"], 3);
  const Json place = Get("/v1/maps/town/places/3").json();
  EXPECT_EQ(place["T_map_place"], page["places"][3]["T_map_place"]);
  EXPECT_EQ(place["polar"]["cells_cm"].size(), 20U * 60U);
  EXPECT_GT(place["posts_cm"].size(), 0U);
  EXPECT_EQ(Get("/v1/maps/town/places/99").status, 404);
  EXPECT_EQ(Get("/v1/maps/town/places/3x").status, 400);
  const Json pair = Get("/v1/maps/town/pairs").json()["pairs"][0];
  EXPECT_EQ(pair["lookalike"], 9);
  EXPECT_NEAR(pair["to"]["x"].get<double>(), 7.1 * 9, 1e-3);
}

TEST_F(ApiTest, TellsWhereOnEarthAndHowPlacesFare) {
  StartWeb();
  const std::string scan = KittiBytes(test::QueryScan(1, 4));
  const Json best = Ask(RequestText("POST", "/v1/localize?map=town", scan)).json()["candidates"][0];
  EXPECT_NEAR(best["geo"]["latitude"].get<double>(), 48.0, 1e-2);
  const double turned =
      best["geo"]["heading_deg"].get<double>() + best["heading_deg"].get<double>();
  EXPECT_NEAR(std::remainder(turned - 90.0, 360.0), 0.0, 1e-2);
  EXPECT_EQ(Get("/v1/maps/town").json()["geo_origin"]["longitude"], 11.0);
  const Json page = Get("/v1/maps/town/places").json();
  EXPECT_EQ(page["places"][3]["geo"], Get("/v1/maps/town/places/3").json()["geo"]);
  const Json use = Get("/v1/maps/town/use").json();
  EXPECT_EQ(use["num_localized"], 1);
  EXPECT_EQ(use["places"][0]["place"], best["place"]);
}

TEST_F(ApiTest, TellsOfTilesUntilTheMapIsReplaced) {
  StartWeb();
  const Json tiles = Get("/v1/maps/town/tiles").json();
  ASSERT_EQ(tiles["tiles"].size(), 1U);
  const std::string path = "/v1/maps/town/tiles/0?content_id=";
  const Said rows = Get(path + tiles["content_id"].get<std::string>());
  EXPECT_EQ(rows.body.size(), kNumPlaces * PlaceTiles::kRowBytes);
  EXPECT_EQ(Get(path + "another").status, 409);
  EXPECT_EQ(Get("/v1/maps/town/tiles/1").status, 404);
}

TEST_F(ApiTest, LocalizesAsTheServerDoes) {
  StartWeb();
  const std::string scan = KittiBytes(test::QueryScan(1, 4));
  const Said said = Ask(RequestText("POST", "/v1/localize?map=town&top=3&structure=true", scan,
                                    "X-Request-Id: of-mine\r\n"));
  ASSERT_EQ(said.status, 200) << said.body;
  const auto direct =
      client::Client::Connect({.address = server_->address()})
          ->LocalizeScan(test::QueryScan(1, 4), {.map = "town", .query = {.max_answers = 3}});
  ASSERT_TRUE(direct.ok()) << direct.status();
  Json told = said.json();
  EXPECT_GT(told["posts_cm"].size(), 0U);
  told.erase("posts_cm");
  told.erase("num_points");
  EXPECT_EQ(told, Json::parse(ToLine(ToJson(*direct))));

  const Json answers = Get("/v1/answers?map=town").json();
  EXPECT_EQ(answers["answers"][0]["request_id"], "of-mine");
  const std::string after = absl::StrCat("/v1/answers?run=", answers["run"].get<std::string>(),
                                         "&after=", answers["next_after"].get<int>());
  EXPECT_EQ(Get(after).json()["answers"].size(), 0U);
}

TEST_F(ApiTest, FindsOutOrIsToldTheFormat) {
  StartWeb();
  const std::string ascii =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n1 2 3\n";
  const std::string pcd =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n";
  for (const std::string& body : {ascii, pcd}) {
    const Said said = Ask(RequestText("POST", "/v1/localize", body));
    EXPECT_EQ(said.status, 200) << said.body;
    EXPECT_EQ(said.json()["num_points"], 1);
    EXPECT_EQ(said.json()["outcome"], "insufficient_scan");
  }
  EXPECT_EQ(Ask(RequestText("POST", "/v1/localize?format=pcd", pcd)).status, 200);
  EXPECT_EQ(Ask(RequestText("POST", "/v1/localize?format=ply", pcd)).status, 400);
  EXPECT_EQ(Ask(RequestText("POST", "/v1/localize?format=exe", pcd)).status, 400);
}

TEST_F(ApiTest, SaysWhatIsWrong) {
  StartWeb();
  const std::string scan = KittiBytes(test::QueryScan(1, 4));
  for (const char* query : {"?method=best", "?top=many", "?top=-1", "?top=0", "?min_confidence=2",
                            "?min_confidence=nan", "?method=a-pc&min_confidence=0.5"}) {
    const Said said = Ask(RequestText("POST", std::string("/v1/localize") + query, scan));
    EXPECT_EQ(said.status, 400) << query << said.body;
    EXPECT_FALSE(said.json()["error"]["message"].empty());
  }
  const std::pair<const char*, const char*> told[] = {
      {"top=99999999999", "it must be a whole number from -2147483648 to 2147483647"},
      {"min_confidence=1e999", "it must be a finite number"},
      {"candidate=3", "known here: format, map, method, min_confidence, structure, top"},
      {"top=1&top=2", "for the second time"},
      {"structure=yes", "it must be true or false"}};
  for (const auto& [query, what] : told) {
    const Said said = Ask(RequestText("POST", std::string("/v1/localize?") + query, scan));
    EXPECT_EQ(said.status, 400) << query;
    EXPECT_THAT(said.json()["error"]["message"].get<std::string>(), HasSubstr(what));
  }
  EXPECT_THAT(Get("/v1/maps?map=town").body, HasSubstr("known here: none"));
  EXPECT_EQ(Ask(RequestText("POST", "/v1/localize?map=nowhere", scan)).status, 404);
  EXPECT_THAT(Ask(RequestText("POST", "/v1/localize", "")).body, HasSubstr("the body is empty"));
  EXPECT_EQ(Ask(RequestText("POST", "/v1/localize", "0123456789")).status, 400);
  EXPECT_EQ(Get("/v1/nothing").status, 404);
  EXPECT_EQ(Get("/").status, 404);
  const Said wrong = Get("/v1/localize");
  EXPECT_EQ(wrong.status, 405);
  EXPECT_THAT(wrong.header, HasSubstr("Allow: POST"));
}

TEST_F(ApiTest, PassesOnTheTokenOfWhoAsks) {
  const test::TempDir dir;
  StartServer(10, dir.Write("tokens",
                            "robot query a-token-that-may-query-1\n"
                            "screen view a-token-that-may-look-02\n"));
  StartWeb();
  const std::string query = "Authorization: Bearer a-token-that-may-query-1\r\n";
  const std::string view = "Authorization: bearer a-token-that-may-look-02\r\n";
  const Said none = Get("/v1/maps");
  EXPECT_EQ(none.status, 401);
  EXPECT_THAT(none.header, HasSubstr("WWW-Authenticate: Bearer"));
  EXPECT_EQ(Get("/v1/maps", "Authorization: Bearer another-token-0000000\r\n").status, 401);
  EXPECT_EQ(Get("/v1/maps", query).status, 200);
  EXPECT_EQ(Get("/v1/maps/town/tiles").status, 401);
  EXPECT_EQ(Get("/v1/maps/town/tiles", query).status, 200);
  EXPECT_EQ(Get("/v1/maps/town/tiles").status, 401);  // what is kept is not for everybody
  EXPECT_EQ(Get("/v1/answers", query).status, 403);
  EXPECT_EQ(Get("/v1/events", query).status, 403);
  EXPECT_EQ(Get("/v1/answers", view).status, 200);
}

TEST_F(ApiTest, SaysThatTheServerIsAway) {
  StartWeb();
  EXPECT_EQ(Get("/v1/health").json()["serving"], true);
  server_->Shutdown();
  server_.reset();
  const Said said = Get("/v1/health");
  EXPECT_EQ(said.status, 503);
  EXPECT_EQ(said.json()["serving"], false);
}

TEST_F(ApiTest, TellsOfAnswersAsTheyCome) {
  HttpOptions options;
  options.event_interval = std::chrono::milliseconds(10);
  StartWeb(options);
  const test::TcpConnection watcher(address_);
  watcher.Send("GET /v1/events?map=town HTTP/1.1\r\nHost: localhost\r\n\r\n");
  std::string text;
  const auto await = [&](const std::string& wanted) {
    while (text.find(wanted) == std::string::npos) {
      const std::string more = watcher.Read(1);
      ASSERT_FALSE(more.empty()) << text;
      text += more;
    }
  };
  await("text/event-stream");
  await(": nothing new\n\n");
  for (const char* id : {"first-one", "second-one"}) {
    const std::string scan = KittiBytes(test::QueryScan(1, 4));
    ASSERT_EQ(
        Ask(RequestText("POST", "/v1/localize", scan, std::string("X-Request-Id: ") + id + "\r\n"))
            .status,
        200);
    await("\"request_id\":\"" + std::string(id) + "\"");
  }
  await("\n\n");
  // Who comes back gets what he missed, and nothing twice.
  const std::size_t begin = text.find("id: ") + 4;
  const std::string first_id = text.substr(begin, text.find('\n', begin) - begin);
  const test::TcpConnection again(address_);
  again.Send("GET /v1/events HTTP/1.1\r\nHost: localhost\r\nLast-Event-ID: " + first_id +
             "\r\n\r\n");
  std::string missed;
  while (missed.find("second-one") == std::string::npos) {
    const std::string more = again.Read(1);
    ASSERT_FALSE(more.empty()) << missed;
    missed += more;
  }
  EXPECT_EQ(missed.find("first-one"), std::string::npos);
}

}  // namespace
}  // namespace scanloc::web
