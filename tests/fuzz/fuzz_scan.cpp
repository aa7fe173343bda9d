// Scan files, and matrices of descriptors: the first byte chooses the layout, the rest
// is the file.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "scan_decoders.hpp"
#include "scanloc/dataset/matrix_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scanloc::dataset;
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 8) {
    case 0:
      (void)DecodeKittiBin(bytes, true);
      break;
    case 1:
      (void)DecodePcd(bytes, true);
      break;
    case 2:
      (void)DecodePly(bytes, true);
      break;
    case 3:
      (void)DecodeNcltSync(bytes, true);
      break;
    case 4:
      (void)DecodeOxford(bytes, true, true);
      break;
    case 5:
      (void)DecodeOxford(bytes, false, true);
      break;
    case 6:
      (void)DecodeNpy(bytes, true);
      break;
    default:
      (void)DecodeNpyMatrix(bytes);
  }
  return 0;
}
