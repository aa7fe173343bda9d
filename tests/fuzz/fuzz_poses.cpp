// Files of poses, times, calibrations and fixes, and messages with a fix: the first byte chooses
// the reader, the rest is the file.
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "scanloc/dataset/gnss_fixes.hpp"
#include "scanloc/dataset/pose_reader.hpp"
#include "scanloc/dataset/ros_messages.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scanloc::dataset;
  if (size == 0) return 0;
  const int fd = memfd_create("poses", 0);
  if (fd < 0 || write(fd, data + 1, size - 1) != static_cast<ssize_t>(size - 1)) return 0;
  const std::string path = "/proc/self/fd/" + std::to_string(fd);
  constexpr std::array kFormats = {PoseFormat::kAuto,   PoseFormat::kKitti,  PoseFormat::kTum,
                                   PoseFormat::kMulran, PoseFormat::kNclt,   PoseFormat::kOxford,
                                   PoseFormat::kNaver,  PoseFormat::kMatrix, PoseFormat::kKitti360};
  const std::size_t choice = data[0] % (kFormats.size() + 5);
  if (choice < kFormats.size()) {
    (void)ReadTrajectory(path, kFormats[choice]);
  } else if (choice == kFormats.size()) {
    (void)ReadTimes(path);
  } else if (choice == kFormats.size() + 1) {
    (void)ReadCalib(path);
  } else if (choice == kFormats.size() + 2) {
    const auto fixes = ReadGnssFixes(path);
    if (fixes.ok()) (void)FixAt(*fixes, fixes->front().stamp_ns + 1);
  } else {
    const bool is_ros1 = choice == kFormats.size() + 3;
    (void)DecodeFix(is_ros1 ? WireFormat::kRos1 : WireFormat::kCdr,
                    {reinterpret_cast<const char*>(data + 1), size - 1});
  }
  close(fd);
  return 0;
}
