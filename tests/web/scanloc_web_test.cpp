// The program as it is started.
#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <optional>

#include "http_fixture.hpp"
#include "support/map_files.hpp"
#include "support/open_watch.hpp"
#include "support/paths.hpp"
#include "support/process.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::web {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class ScanlocWebTest : public testing::Test {
 protected:
  [[nodiscard]] static std::vector<std::string> Command(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), test::BinDir() + "/scanloc-web");
    return arguments;
  }

  void StartScanlocd() {
    const std::string map = dir_.File("town.scanloc");
    test::WriteSmallMap(map, 1, 4);
    scanlocd_.emplace(std::vector<std::string>{test::BinDir() + "/scanlocd", "--map", "town=" + map,
                                               "--listen", "127.0.0.1:0"});
    const std::string line = scanlocd_->ReadLine();
    server_ = line.substr(line.rfind(' ') + 1);
  }

  /// What starts a program that may have so many files open.
  [[nodiscard]] static std::vector<std::string> WithDescriptors(int limit) {
    return {"/bin/sh", "-c", "ulimit -n " + std::to_string(limit) + "; exec \"$@\"", "sh"};
  }

  /// `before`: what the program is started by.
  std::string StartWeb(std::vector<std::string> before = {}) {
    const auto command = Command({"--server", server_, "--listen", "127.0.0.1:0"});
    before.insert(before.end(), command.begin(), command.end());
    web_.emplace(before);
    const std::string line = web_->ReadLine();
    EXPECT_THAT(line, StartsWith("scanloc-web ready on http://127.0.0.1:")) << web_->stderr_text();
    return line.substr(line.rfind('/') + 1);
  }

  test::TempDir dir_;
  std::optional<test::Process> scanlocd_;
  std::optional<test::Process> web_;
  std::string server_ = "127.0.0.1:1";
};

TEST_F(ScanlocWebTest, ServesUntilItIsToldToStop) {
  StartScanlocd();
  const std::string address = StartWeb();
  const Said said = Parse([&] {
    const test::TcpConnection connection(address);
    connection.Send(RequestText("GET", "/v1/maps"));
    return connection.ReadAll();
  }());
  EXPECT_EQ(said.json()["maps"][0]["name"], "town");
  const test::TcpConnection idle(address);
  web_->Signal(SIGTERM);
  EXPECT_EQ(web_->Wait(), 0) << web_->stderr_text();
}

TEST_F(ScanlocWebTest, StopsAsToldBeforeItServes) {
  const std::string token = dir_.Write("token", "guest\n" + std::string(60'000, '\n'));
  const test::OpenWatch opened(token);
  web_.emplace(Command({"--server", server_, "--listen", "127.0.0.1:0", "--token-file", token}));
  opened.Await();
  web_->Signal(SIGTERM);
  EXPECT_EQ(web_->Wait(), 0) << web_->stderr_text();
}

TEST_F(ScanlocWebTest, WaitsForNoPipe) {
  const std::string pipe = dir_.File("index.html");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--https-cert", pipe, "--https-key", pipe},
        {"--page", dir_.path().string()}}) {
    std::vector<std::string> command = Command({"--server", server_, "--listen", "127.0.0.1:0"});
    command.insert(command.end(), arguments.begin(), arguments.end());
    const test::ProcessResult refused = test::RunProcess(command);
    EXPECT_EQ(refused.status, 1);
    EXPECT_THAT(refused.err, HasSubstr("not a regular file"));
  }
}

TEST_F(ScanlocWebTest, StartsBeforeItsServerDoes) {
  const std::string address = StartWeb();
  const test::TcpConnection connection(address);
  connection.Send(RequestText("GET", "/v1/health"));
  EXPECT_EQ(Parse(connection.ReadAll()).status, 503);
}

TEST_F(ScanlocWebTest, HasDescriptorsLeftForTheServerWhateverGuestsTake) {
  StartScanlocd();
  const std::string address = StartWeb(WithDescriptors(256));
  std::vector<test::TcpConnection> guests;
  for (const char* from : {"127.0.0.1", "127.0.0.2", "127.0.0.3"}) {
    for (int i = 0; i < 120; ++i) guests.emplace_back(address, from);
  }
  guests.front().Send(RequestText("GET", "/v1/maps", "", "Authorization: Bearer anew\r\n"));
  EXPECT_EQ(Parse(guests.front().ReadAll()).status, 200);

  std::vector<std::string> command = WithDescriptors(128);
  for (const std::string& word : Command({"--server", server_, "--listen", "127.0.0.1:0"})) {
    command.push_back(word);
  }
  test::Process too_few(command);
  EXPECT_EQ(too_few.Wait(), 1);
  EXPECT_THAT(too_few.stderr_text(), HasSubstr("only 128 files"));
}

TEST_F(ScanlocWebTest, RefusesWhatItCannotServeSafely) {
  const auto refuses = [](std::vector<std::string> arguments, int status, const char* why) {
    arguments.insert(arguments.end(), {"--server", "127.0.0.1:1"});
    test::Process program(Command(arguments));
    EXPECT_EQ(program.Wait(), status) << program.stderr_text();
    EXPECT_THAT(program.stderr_text(), HasSubstr(why));
  };
  refuses({"--listen", "0.0.0.0:0"}, 2, "without HTTPS");
  refuses({"--listen", "nonsense"}, 2, "HOST:PORT");
  refuses({"--snapshot", "x.html"}, 2, "--map");
  refuses({"--listen", "127.0.0.1:0", "--https-cert", "none.pem"}, 1, "private key");
  refuses({"--listen", "127.0.0.1:0", "--page", "/nonexistent"}, 1, "there is no page");
}

TEST_F(ScanlocWebTest, WritesTheMapAsOneFile) {
  StartScanlocd();
  const std::string page = dir_.File("page");
  std::filesystem::create_directory(page);
  std::ofstream(page + "/index.html")
      << "<link rel=\"stylesheet\" href=\"page.css\">"
         "<script id=\"snapshot\" type=\"application/json\">null</script>"
         "<script type=\"module\" src=\"page.js\"></script>";
  std::ofstream(page + "/page.js") << "const a = '</script>';";
  std::ofstream(page + "/page.css") << "p {}";
  const std::string file = dir_.File("town.html");
  test::Process program(
      Command({"--server", server_, "--map", "town", "--snapshot", file, "--page", page}));
  ASSERT_EQ(program.Wait(), 0) << program.stderr_text();
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(text, HasSubstr("<style>p {}</style>"));
  EXPECT_THAT(text, HasSubstr("const a = '<\\/script>';"));
  const std::string mark = "type=\"application/json\">";
  const std::size_t begin = text.find(mark) + mark.size();
  const Json data = Json::parse(text.substr(begin, text.find("</script>", begin) - begin));
  EXPECT_EQ(data["responses"]["/v1/maps/town"]["json"]["num_places"], 4);
  EXPECT_FALSE(data["responses"]["/v1/maps/town/tiles/0"]["base64"].get<std::string>().empty());
}

}  // namespace
}  // namespace scanloc::web
