// Scan files, matrices of descriptors and radar images: the first byte chooses the layout, the rest
// is the file.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "scan_decoders.hpp"
#include "scanloc/dataset/matrix_file.hpp"
#include "scanloc/dataset/radar.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace scanloc::dataset;
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 11) {
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
    case 7:
      (void)DecodeNpyMatrix(bytes);
      break;
    case 8:
      (void)DecodeRadar(bytes, RadarLayout::kOxford, 0.5);
      break;
    case 9:
      (void)DecodeRadar(bytes, RadarLayout::kMulran, 0.5);
      break;
    default:
      (void)DecodeRadar(bytes, RadarLayout::kCartesian, 0.5);
  }
  return 0;
}
