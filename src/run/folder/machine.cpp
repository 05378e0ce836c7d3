#include "run/folder/machine.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <thread>

#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/vector_level.h"
#include "trace/embree/instructions.h"

#ifndef CATOPTRIC_VERSION
#error "CATOPTRIC_VERSION must come from the build"
#endif

namespace catoptric::run {

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
    try {
      // Through the link: /proc/self/exe itself is no regular file to open(2) flags of readFile().
      fingerprint.add(
          std::span<const std::byte>(readFile(std::filesystem::read_symlink("/proc/self/exe"))));
    } catch (const std::exception&) {
      fingerprint.add(std::string_view(CATOPTRIC_VERSION " " __DATE__ " " __TIME__));
    }
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
