// The real program under a service manager, and while its maps load.
#include <sqlite3.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

#include "scanlocd_fixture.hpp"

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// Where a service manager listens to its services.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& path) : file_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    if (bind(file_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("cannot bind " + path);
    }
    const timeval patience = {.tv_sec = test::Process::kPatience.count(), .tv_usec = 0};
    setsockopt(file_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  ~NotifySocket() {
    unsetenv("NOTIFY_SOCKET");
    close(file_);
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  [[nodiscard]] std::string Next() const {
    std::array<char, 256> text{};
    const ssize_t size = recv(file_, text.data(), text.size(), 0);
    return {text.data(), size > 0 ? static_cast<std::size_t>(size) : 0};
  }

 private:
  int file_;
};

class ScanlocdServiceTest : public ScanlocdTest {};

TEST_F(ScanlocdServiceTest, TellsTheServiceManagerWhatItIsAt) {
  const NotifySocket manager(dir_.File("notify"));
  Start({"--map", "town=" + WriteMap("town", 1)});
  EXPECT_EQ(manager.Next(), "READY=1");
  scanlocd_->Signal(SIGHUP);
  EXPECT_THAT(manager.Next(), StartsWith("RELOADING=1\nMONOTONIC_USEC="));
  EXPECT_EQ(manager.Next(), "READY=1");
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(manager.Next(), "STOPPING=1");
  EXPECT_EQ(scanlocd_->Wait(), 0);
}

TEST_F(ScanlocdServiceTest, TellsTheWatchdogThatItHasAnsweredItself) {
  const NotifySocket manager(dir_.File("notify"));
  setenv("WATCHDOG_USEC", "60000000", 1);
  Start({"--map", "town=" + WriteMap("town", 1)});
  unsetenv("WATCHDOG_USEC");
  std::string told;
  do {
    told = manager.Next();
  } while (told == "READY=1");
  EXPECT_EQ(told, "WATCHDOG=1");
}

TEST_F(ScanlocdServiceTest, ServesThoughTheServiceManagerDoesNotListen) {
  setenv("NOTIFY_SOCKET", dir_.File("nobody").c_str(), 1);
  Start({"--map", "town=" + WriteMap("town", 1)});
  unsetenv("NOTIFY_SOCKET");
  EXPECT_TRUE(Connect().LocalizeScan(test::QueryScan(1, 2)).ok());
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->stderr_text(), HasSubstr("cannot tell the service manager"));
}

/// Keeps readers of a database waiting.
class DatabaseLock {
 public:
  explicit DatabaseLock(const std::string& path) {
    if (sqlite3_open(path.c_str(), &database_) != SQLITE_OK ||
        sqlite3_exec(database_, "BEGIN EXCLUSIVE", nullptr, nullptr, nullptr) != SQLITE_OK) {
      throw std::runtime_error("cannot lock " + path);
    }
  }
  ~DatabaseLock() { sqlite3_close(database_); }
  DatabaseLock(const DatabaseLock&) = delete;
  DatabaseLock& operator=(const DatabaseLock&) = delete;

 private:
  sqlite3* database_ = nullptr;
};

TEST_F(ScanlocdServiceTest, StopsWellWhileAMapLoads) {
  const std::string map = WriteMap("town", 1);
  const DatabaseLock lock(map);  // so that the map loads for seconds
  scanlocd_.emplace(Command({"--map", "town=" + map, "--listen", "127.0.0.1:0", "--metrics-listen",
                             "127.0.0.1:0", "--drain-seconds", "0"}),
                    test::ProcessOptions{.merge_stderr = true});
  ASSERT_NE(scanlocd_->ReadLineWith("metrics on http://"), "");
  scanlocd_->Signal(SIGTERM);
  EXPECT_EQ(scanlocd_->Wait(), 0);
  EXPECT_THAT(scanlocd_->rest_of_stdout(), Not(HasSubstr("scanlocd ready")));
}

}  // namespace
}  // namespace scanloc::server
