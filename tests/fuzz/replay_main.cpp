// Runs a fuzz target over files and folders of inputs, and over every prefix of each: what a fuzzer
// found once stays found, without a fuzzer. Fails if there is no input.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int argc, char** argv) try {
  constexpr std::size_t kMaxPrefixes = 200;
  std::size_t num_inputs = 0;
  for (int i = 1; i < argc; ++i) {
    if (!std::filesystem::exists(argv[i])) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[i])) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path(), std::ios::binary);
      const std::string bytes{std::istreambuf_iterator<char>(file),
                              std::istreambuf_iterator<char>()};
      const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
      LLVMFuzzerTestOneInput(data, bytes.size());
      const std::size_t step = bytes.size() / kMaxPrefixes + 1;
      for (std::size_t size = 0; size < bytes.size(); size += step) {
        // A copy of its own: reading beyond the prefix is then reading beyond the buffer.
        const std::string prefix = bytes.substr(0, size);
        LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(prefix.data()), size);
      }
      ++num_inputs;
    }
  }
  std::printf("%zu inputs and their prefixes\n", num_inputs);
  return num_inputs == 0 ? 1 : 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
