// Writes the golden map file of the current schema version, once, when the version is released:
//   build/release/bin/make_golden_map tests/data/golden_map_v1.scanloc
#include <iostream>

#include "support/golden_map.hpp"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_golden_map FILE\n";
    return 2;
  }
  const absl::Status status = scanloc::test::MakeGoldenMap(argv[1]);
  if (!status.ok()) std::cerr << status << '\n';
  return status.ok() ? 0 : 1;
}
