// Map files: loaded, told of, opened and verified; a map that loads must answer. And what is kept
// of how a map fares: what is read is written alike.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>

#include "scanloc/core/localizer.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/mapdb/use_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scanloc;
  static const std::string path = "/dev/shm/scanloc-fuzz-" + std::to_string(getpid());
  static const bool is_removed_at_exit = [] {
    std::atexit([] { unlink(path.c_str()); });
    return true;
  }();
  (void)is_removed_at_exit;
  {
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  }
  if (const auto use = mapdb::ReadUse(path, 1 << 20); use.ok()) {
    const auto again = mapdb::DecodeUse(mapdb::EncodeUse(*use));
    if (!again.ok() || *again != *use) std::abort();
  }
  (void)mapdb::FindProblems(path);
  absl::StatusOr<Map> maps[] = {mapdb::LoadMap(path), mapdb::OpenMap(path)};
  for (auto& map : maps) {
    if (!map.ok()) continue;
    if (map->payload != nullptr) (void)map->payload->Scrub([](std::size_t) { return true; });
    const auto localizer = Localizer::Create(std::make_shared<const Map>(*std::move(map)));
    if (localizer.ok()) (void)(*localizer)->Localize(ScanDescriptor());
  }
  return 0;
}
