// Bags: the whole input is a file. Its messages are read, and clouds and poses decoded.
#include <fcntl.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scanloc/dataset/bag_drive.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scanloc::dataset;
  // SQLite opens files by their real names, which those of memfd_create lack.
  static const std::string path = "/dev/shm/scanloc-fuzz-bag-" + std::to_string(getpid());
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (fd < 0) return 0;
  if (write(fd, data, size) == static_cast<ssize_t>(size)) {
    std::vector<std::string> notes;
    for (const char* poses : {"", "/odom", "/pose", "tf:odom"}) {
      const auto drive = OpenBagDrive({.paths = {path}, .topic = "/points", .poses_from = poses});
      if (!drive.ok()) continue;
      for (const Frame& frame : drive->frames) (void)ReadScan(frame.file());
    }
    (void)ListBagScans({.paths = {path}}, notes);
  }
  close(fd);
  unlink(path.c_str());
  return 0;
}
