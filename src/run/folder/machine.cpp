#include "run/folder/machine.h"

#include <link.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <fstream>
#include <thread>

#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/vector_level.h"
#include "gl/given_shaders.h"
#include "trace/embree/instructions.h"

#ifndef CATOPTRIC_VERSION
#error "CATOPTRIC_VERSION must come from the build"
#endif

namespace catoptric::run {
namespace {

/// The linker's hash of the running program, from its notes. Reading and hashing the file took
/// 18 ms of every start.
std::span<const std::byte> linkersBuildId() {
  std::span<const std::byte> id;
  const auto visit = [](dl_phdr_info* info, std::size_t, void* found) {
    for (int i = 0; i < info->dlpi_phnum; ++i) {
      const ElfW(Phdr)& segment = info->dlpi_phdr[i];
      if (segment.p_type != PT_NOTE) continue;
      const auto* note = reinterpret_cast<const std::byte*>(info->dlpi_addr + segment.p_vaddr);
      const std::byte* end = note + segment.p_memsz;
      while (note + sizeof(ElfW(Nhdr)) <= end) {
        ElfW(Nhdr) head;
        std::memcpy(&head, note, sizeof head);
        const auto padded = [](std::size_t bytes) { return (bytes + 3) / 4 * 4; };
        const std::byte* content = note + sizeof head + padded(head.n_namesz);
        if (head.n_type == NT_GNU_BUILD_ID)
          *static_cast<std::span<const std::byte>*>(found) = {content, head.n_descsz};
        note = content + padded(head.n_descsz);
      }
    }
    return 1;  // the program comes first
  };
  dl_iterate_phdr(visit, &id);
  if (id.empty()) throw Error(ExitCode::Internal, "the program was linked without --build-id");
  return id;
}

}  // namespace

const char* versionText() {
  return CATOPTRIC_VERSION;
}

std::string processorName() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("model name")) continue;
    const std::size_t colon = line.find(": ");
    if (colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

std::string instructionSets() {
  constexpr std::array kLevels = {"x86-64", "x86-64-v2", "x86-64-v3", "x86-64-v4"};
  return "Embree " + trace::embreeInstructions() + ", " +
         kLevels[static_cast<std::size_t>(vectorLevel())];
}

std::string buildFingerprint() {
  static const std::string text = [] {
    Fingerprint fingerprint;
    fingerprint.add(linkersBuildId());
    fingerprint.add(gl::givenShaders());
    return fingerprint.text();
  }();
  return text;
}

std::uint64_t physicalMemoryBytes() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(::sysconf(_SC_PAGE_SIZE));
}

std::string machineJson() {
  utsname system{};
  ::uname(&system);
  return config::JsonText()
      .add("host", system.nodename)
      .add("processor", processorName())
      .add("instructions", instructionSets())
      .add("processors", static_cast<int>(std::thread::hardware_concurrency()))
      .add("threads", threadCount())
      .add("memory_bytes", physicalMemoryBytes())
      .add("system", std::string(system.sysname) + " " + system.release)
      .add("version", versionText())
      .add("build", buildFingerprint())
      .add("compiler", __VERSION__)
      .object();
}

}  // namespace catoptric::run
