// replay FOLDER MUTATIONS [FOLDER...]   runs a fuzz target over all files of the folders, then over
// MUTATIONS changed ones, the same in every run. A crash ends it; a slow input fails it.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "memory_file.h"

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr double kSlowSeconds = 10.0;  // of the processor: other programs do not count

/// [Steele2014] SplitMix64.
struct Random {
  std::uint64_t state = 1;
  std::size_t below(std::size_t bound) {
    std::uint64_t z = (state += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return static_cast<std::size_t>((z ^ (z >> 31)) % bound);
  }
};

/// A few changes: bytes, numbers, pieces cut, doubled, or taken from another file.
Bytes changed(Bytes bytes, const Bytes& other, Random& random) {
  static const char* const kWords[] = {"-1", "0",  "1e999", "1e19", "4294967295", "null",
                                       "{}", "[]", "\"\"",  "0.5",  "true",       "999999999999"};
  for (std::size_t n = 1 + random.below(4); n > 0 && !bytes.empty(); --n) {
    const std::size_t at = random.below(bytes.size());
    const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const std::size_t length = 1 + random.below(std::min<std::size_t>(bytes.size() - at, 64));
    const auto end = place + static_cast<std::ptrdiff_t>(length);
    switch (random.below(7)) {
      case 0:
        *place ^= static_cast<std::uint8_t>(1u << random.below(8));
        break;
      case 1:
        *place = static_cast<std::uint8_t>(random.below(256));
        break;
      case 2:
        bytes.erase(place, end);
        break;
      case 3: {
        const Bytes piece(place, end);
        bytes.insert(place, piece.begin(), piece.end());
        break;
      }
      case 4: {
        static constexpr std::uint8_t kEdges[] = {0x00, 0x7F, 0x80, 0xFF};
        std::fill(place, place + static_cast<std::ptrdiff_t>(std::min<std::size_t>(length, 4)),
                  kEdges[random.below(4)]);
        break;
      }
      case 5: {
        // The number or word that begins here, in JSON
        const auto stop = std::find_if(place, bytes.end(), [](std::uint8_t c) {
          return c == ',' || c == ']' || c == '}' || c == '\n';
        });
        const std::string word = kWords[random.below(std::size(kWords))];
        bytes.erase(place, stop);
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), word.begin(), word.end());
        break;
      }
      default:
        if (!other.empty()) {
          const std::size_t from = random.below(other.size());
          const std::size_t count =
              1 + random.below(std::min<std::size_t>(other.size() - from, 64));
          const auto first = other.begin() + static_cast<std::ptrdiff_t>(from);
          bytes.insert(place, first, first + static_cast<std::ptrdiff_t>(count));
        }
    }
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  if (argc < 3) {
    std::fprintf(stderr, "usage: replay FOLDER MUTATIONS [FOLDER...]\n");
    return 2;
  }
  std::vector<fs::path> names;
  for (int i = 1; i < argc; ++i) {
    if (i == 2 || !fs::is_directory(argv[i])) continue;
    for (const fs::directory_entry& entry : fs::directory_iterator(argv[i])) {
      if (entry.is_regular_file()) names.push_back(entry.path());
    }
  }
  std::sort(names.begin(), names.end());
  if (names.empty()) {
    std::fprintf(stderr, "%s: no inputs\n", argv[1]);
    return 1;
  }
  std::vector<Bytes> corpus;
  for (const fs::path& name : names) {
    std::ifstream stream(name, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  }

  Random random;
  const std::size_t mutations = std::stoul(argv[2]);
  for (std::size_t i = 0; i < corpus.size() + mutations; ++i) {
    const Bytes input = i < corpus.size() ? corpus[i]
                                          : changed(corpus[random.below(corpus.size())],
                                                    corpus[random.below(corpus.size())], random);
    const std::clock_t start = std::clock();
    LLVMFuzzerTestOneInput(input.data(), input.size());
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    if (seconds > kSlowSeconds) {
      std::ofstream("slow_input", std::ios::binary)
          .write(reinterpret_cast<const char*>(input.data()),
                 static_cast<std::streamsize>(input.size()));
      std::fprintf(stderr, "input %zu took %.1f s; it is in slow_input\n", i, seconds);
      return 1;
    }
  }
  std::printf("%zu inputs and %zu changes of them\n", corpus.size(), mutations);
  return 0;
}
