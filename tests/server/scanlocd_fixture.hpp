#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "scanloc/client/client.hpp"
#include "support/map_files.hpp"
#include "support/paths.hpp"
#include "support/process.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::server {

inline constexpr int kNumPlaces = 8;

/// The real program, on maps of its own.
class ScanlocdTest : public testing::Test {
 protected:
  static std::vector<std::string> Command(const std::vector<std::string>& arguments) {
    std::vector<std::string> command = {test::BinDir() + "/scanlocd"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return command;
  }

  /// Starts the program on a free port and waits until it is ready.
  void Start(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--listen", "127.0.0.1:0"});
    scanlocd_.emplace(Command(arguments));
    const std::string line = scanlocd_->ReadLine();
    ASSERT_THAT(line, testing::StartsWith("scanlocd ready on 127.0.0.1:"))
        << scanlocd_->stderr_text();
    address_ = line.substr(std::string("scanlocd ready on ").size());
  }

  [[nodiscard]] std::string WriteMap(const std::string& name, std::uint64_t seed) const {
    const std::string path = dir_.File(name + ".scanloc");
    test::WriteSmallMap(path, seed, kNumPlaces);
    return path;
  }

  [[nodiscard]] client::Client Connect() const {
    auto client = client::Client::Connect({.address = address_});
    if (!client.ok()) throw std::runtime_error(client.status().ToString());
    return *std::move(client);
  }

  /// Sends SIGHUP and waits until the map is in service for the `generation`-th time.
  void ReloadAndAwait(const client::Client& client, const std::string& map,
                      std::uint64_t generation) {
    scanlocd_->Signal(SIGHUP);
    while (true) {
      const auto info = client.GetMapInfo(map);
      if (info.ok() && info->generation == generation) return;
      std::this_thread::yield();
    }
  }

  test::TempDir dir_;
  std::optional<test::Process> scanlocd_;
  std::string address_;
};

}  // namespace scanloc::server
