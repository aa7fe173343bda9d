// Files of poses, times and calibrations: the first byte chooses the reader, the rest is the file.
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "scanloc/dataset/pose_reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scanloc::dataset;
  if (size == 0) return 0;
  const int fd = memfd_create("poses", 0);
  if (fd < 0 || write(fd, data + 1, size - 1) != static_cast<ssize_t>(size - 1)) return 0;
  const std::string path = "/proc/self/fd/" + std::to_string(fd);
  constexpr std::array kFormats = {PoseFormat::kAuto,   PoseFormat::kKitti,  PoseFormat::kTum,
                                   PoseFormat::kMulran, PoseFormat::kNclt,   PoseFormat::kOxford,
                                   PoseFormat::kNaver,  PoseFormat::kMatrix, PoseFormat::kKitti360};
  const std::size_t choice = data[0] % (kFormats.size() + 2);
  if (choice < kFormats.size()) {
    (void)ReadTrajectory(path, kFormats[choice]);
  } else if (choice == kFormats.size()) {
    (void)ReadTimes(path);
  } else {
    (void)ReadCalib(path);
  }
  close(fd);
  return 0;
}
