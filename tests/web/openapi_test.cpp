// The document says what the program does, and the program does what the document says.
#include <algorithm>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_replace.h"
#include "http_fixture.hpp"

namespace scanloc::web {
namespace {

const Json& Document() {
  static const Json document = Json::parse(kOpenApiDocument);
  return document;
}

/// What of the value is not as the schema has it; empty: nothing.
std::string Violation(const Json& schema, const Json& value, const std::string& where = "") {
  if (schema.contains("$ref")) {
    return Violation(Document().at(Json::json_pointer(schema["$ref"].get<std::string>().substr(1))),
                     value, where);
  }
  if (value.is_null()) return schema.value("nullable", false) ? "" : where + " is null";
  const std::string type = schema["type"];
  const bool is_it =
      (type == "object" && value.is_object()) || (type == "array" && value.is_array()) ||
      (type == "string" && value.is_string()) || (type == "integer" && value.is_number_integer()) ||
      (type == "number" && value.is_number()) || (type == "boolean" && value.is_boolean());
  if (!is_it) return where + " is no " + type;
  if (schema.contains("enum") &&
      std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end()) {
    return where + " is none of the choices";
  }
  if (type == "array") {
    for (std::size_t i = 0; i < value.size(); ++i) {
      const std::string found = Violation(schema["items"], value[i], absl::StrCat(where, "/", i));
      if (!found.empty()) return found;
    }
  }
  if (type != "object" || !schema.contains("properties")) return "";
  for (const Json& name : schema["required"]) {
    if (!value.contains(name.get<std::string>()))
      return where + " lacks " + name.get<std::string>();
  }
  for (const auto& [name, field] : value.items()) {
    if (!schema["properties"].contains(name)) return where + " has " + name;
    const std::string found = Violation(schema["properties"][name], field, where + "/" + name);
    if (!found.empty()) return found;
  }
  return "";
}

class OpenApiTest : public HttpTest {
 protected:
  void SetUp() override {
    StartWeb();
    ASSERT_EQ(Post().status, 200);
  }
  [[nodiscard]] Said Post() const {
    return Ask(RequestText("POST", "/v1/localize?top=3&structure=true",
                           KittiBytes(test::QueryScan(1, 4))));
  }
};

TEST(OpenApiDocument, RefersToWhatItHas) {
  int num_checked = 0;
  const Json flat = Document().flatten();
  for (const auto& [where, value] : flat.items()) {
    if (!absl::EndsWith(where, "/$ref")) continue;
    const std::string target = value.get<std::string>();
    EXPECT_TRUE(Document().contains(Json::json_pointer(target.substr(1)))) << where << target;
    ++num_checked;
  }
  EXPECT_GT(num_checked, 20);
}

TEST_F(OpenApiTest, HasEveryRouteAndNoOther) {
  std::set<std::string> told;
  for (const auto& [path, methods] : Document()["paths"].items()) {
    for (const auto& [method, operation] : methods.items()) {
      told.insert(absl::AsciiStrToUpper(method) + " " + path);
    }
  }
  const std::vector<std::string> routes = api_->Routes();
  EXPECT_EQ(told, std::set<std::string>(routes.begin(), routes.end()));
}

TEST_F(OpenApiTest, DescribesWhatIsAnswered) {
  int num_checked = 0;
  for (const auto& [path, methods] : Document()["paths"].items()) {
    const std::string target =
        absl::StrReplaceAll(path, {{"{map}", "town"}, {"{place}", "3"}, {"{tile}", "0"}});
    for (const auto& [method, operation] : methods.items()) {
      const Json& content = operation["responses"]["200"]["content"];
      if (content.contains("text/event-stream")) continue;  // would not end
      const Said said = method == "post" ? Post() : Get(target);
      ASSERT_EQ(said.status, 200) << path << said.body;
      const std::string type = content.begin().key();
      EXPECT_NE(said.header.find("Content-Type: " + type), std::string::npos) << said.header;
      if (type != "application/json") continue;
      EXPECT_EQ(Violation(content[type]["schema"], said.json()), "") << path;
      ++num_checked;
    }
  }
  EXPECT_EQ(num_checked, 11);
  const Said wrong = Get("/v1/maps/nowhere");
  EXPECT_EQ(Violation(Document()["components"]["schemas"]["Error"], wrong.json()), "");
}

TEST_F(OpenApiTest, TheCheckItselfFindsWhatIsWrong) {
  const Json& schema = Document()["components"]["schemas"]["MapSummary"];
  Json good = Get("/v1/maps").json()["maps"][0];
  EXPECT_EQ(Violation(schema, good), "");
  Json more = good;
  more["surplus"] = 1;
  EXPECT_NE(Violation(schema, more), "");
  good.erase("state");
  EXPECT_NE(Violation(schema, good), "");
}

}  // namespace
}  // namespace scanloc::web
