// Fuzz targets: each reads one kind of input from memory as the program reads it from a file, and
// lets nothing but the errors of core/error.h out. Built with Clang they are libFuzzer's (preset
// fuzz, scripts/fuzz); with any compiler replay.cpp drives them (test fuzz_KIND).
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace catoptric::fuzz {

/// A file that lives in memory only; its folder holds nothing that an input could name.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : handle_(memfd_create("input", 0)) {
    if (handle_ < 0) std::abort();
    for (std::size_t done = 0; done < size;) {
      const ssize_t count = write(handle_, data + done, size - done);
      if (count <= 0) std::abort();
      done += static_cast<std::size_t>(count);
    }
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(handle_); }
  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(handle_); }

 private:
  int handle_;
};

}  // namespace catoptric::fuzz
