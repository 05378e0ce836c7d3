// The machine and program that make a run: the context of its measurements, and what its pixels
// depend on.
#pragma once

#include <cstdint>
#include <string>

namespace catoptric::run {

/// For example "Intel(R) Xeon(R) ..."; "unknown processor" if the system does not tell.
std::string processorName();

/// The instruction sets that determine the last bits of pixels, e.g. "Embree avx512, x86-64-v4".
std::string instructionSets();

/// The fingerprint of the running program's contents, which identifies the build.
std::string buildFingerprint();

std::uint64_t physicalMemoryBytes();

/// A JSON object with host, processor, number of processors, memory, kernel, threads, version and
/// compiler.
std::string machineJson();

/// The version of the program.
const char* versionText();

}  // namespace catoptric::run
