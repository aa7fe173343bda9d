#pragma once

#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "support/process.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::test {

/// A PostgreSQL server of its own, which only this machine's sockets reach; Debian's programs, run
/// as their user where the test is root's.
class Postgres {
 public:
  Postgres() {
    Own(dir_.path());
    Run({kPrograms + "initdb", "--pgdata", Data(), "--username", "postgres", "--auth", "trust",
         "--no-sync"});
    Start();
  }

  [[nodiscard]] std::string Url() const {
    return "postgresql://postgres@/postgres?host=" + dir_.path().string();
  }

  void Start() {
    server_ = std::make_unique<Process>(
        AsOwner({kPrograms + "postgres", "-D", Data(), "-k", dir_.path().string(), "-c",
                 "listen_addresses=", "-c", "fsync=off"}),
        ProcessOptions{.stdout_path = "/dev/null", .stderr_path = "/dev/null"});
    const auto patience = std::chrono::steady_clock::now() + Process::kPatience;
    while (RunProcess({kPrograms + "pg_isready", "-q", "-h", dir_.path().string()}).status != 0) {
      if (std::chrono::steady_clock::now() > patience) throw std::runtime_error("no database");
      std::this_thread::yield();
    }
  }
  /// As when its machine fails: connections end at once.
  void Stop() {
    server_->Signal(SIGQUIT);
    server_->Wait();
    server_.reset();
  }
  ~Postgres() {
    if (server_ != nullptr) Stop();
  }

  /// Runs SQL behind the catalogue's back, and gives what it prints.
  [[nodiscard]] std::string Sql(const std::string& sql) const {
    const ProcessResult result =
        RunProcess({kPrograms + "psql", "-h", dir_.path().string(), "-U", "postgres", "-tAc", sql});
    if (result.status != 0) throw std::runtime_error(result.err);
    return result.out;
  }

  [[nodiscard]] static bool IsInstalled() {
    return std::filesystem::exists(kPrograms + "postgres");
  }

 private:
  inline static const std::string kPrograms = "/usr/lib/postgresql/15/bin/";

  [[nodiscard]] std::string Data() const { return dir_.File("data"); }

  static void Own(const std::filesystem::path& path) {
    if (geteuid() == 0) Run({"/usr/bin/chown", "postgres:postgres", path.string()}, false);
  }
  static std::vector<std::string> AsOwner(std::vector<std::string> command) {
    if (geteuid() != 0) return command;
    std::vector<std::string> front = {"/usr/bin/setpriv", "--reuid=postgres", "--regid=postgres",
                                      "--clear-groups"};
    command.insert(command.begin(), front.begin(), front.end());
    return command;
  }
  static void Run(const std::vector<std::string>& command, bool as_owner = true) {
    const ProcessResult result = RunProcess(as_owner ? AsOwner(command) : command);
    if (result.status != 0) throw std::runtime_error(command.front() + ": " + result.err);
  }

  TempDir dir_;
  std::unique_ptr<Process> server_;
};

}  // namespace scanloc::test
