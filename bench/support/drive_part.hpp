#pragma once

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_split.h"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"

/// For programs that measure drives: the first error ends them.
namespace scanloc::bench {

[[noreturn]] inline void Fail(const std::string& message) {
  std::cerr << "error: " << message << "\n";
  std::exit(1);
}

template <typename T>
T Get(absl::StatusOr<T> result) {
  if (!result.ok()) Fail(std::string(result.status().message()));
  return *std::move(result);
}

/// Of a folder with scans and poses.txt, or FOLDER:FROM:TO:STEP for some of them.
inline std::vector<dataset::Frame> Frames(const std::string& drive) {
  const std::vector<std::string> parts = absl::StrSplit(drive, ':');
  const auto number = [&](std::size_t i, std::size_t otherwise) -> std::size_t {
    return i < parts.size() ? std::stoul(parts[i]) : otherwise;
  };
  const std::vector<dataset::Frame> all =
      Get(dataset::OpenDrive({.scans_dir = parts[0], .poses_file = parts[0] + "/poses.txt"}))
          .frames;
  std::vector<dataset::Frame> kept;
  for (std::size_t i = number(1, 0); i < std::min(number(2, all.size()), all.size());
       i += number(3, 1)) {
    kept.push_back(all[i]);
  }
  return kept;
}

}  // namespace scanloc::bench
