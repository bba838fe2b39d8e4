// Runs a fuzzer's committed inputs once each: an ordinary test, without libFuzzer, under a limit of memory.

#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace {

/// More than any input may take, less than what one takes that is believed: the bomb of 42 bytes asks for 1.2 GB.
constexpr rlim_t kMemoryBytes = rlim_t{512} << 20;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsSanitized = true;  // its shadow takes terabytes of addresses
#else
constexpr bool kIsSanitized = false;
#endif

/// Addresses that this process has taken so far, libraries included.
rlim_t taken_bytes() {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * 4096;
}

}  // namespace

int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  if (argc < 2 || !std::all_of(argv + 1, argv + argc, [](const char* path) { return fs::is_directory(path); })) {
    std::cerr << "usage: " << argv[0] << " FOLDER ...\n";
    return 2;
  }
  if (!kIsSanitized) {
    const rlim_t most = taken_bytes() + kMemoryBytes;
    const rlimit limit{most, most};
    if (setrlimit(RLIMIT_AS, &limit) != 0) return 2;
  }
  std::vector<fs::path> files;
  for (int i = 1; i < argc; ++i) {
    for (const auto& entry : fs::directory_iterator(argv[i])) {
      if (entry.is_regular_file()) files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    std::cout << file.filename().string() << std::endl;  // the last line names the input that ends us
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }
  std::cout << files.size() << " inputs\n";
  return files.empty() ? 1 : 0;
}
