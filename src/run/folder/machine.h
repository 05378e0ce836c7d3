// Where and by what a run is made: the context of its figures, and what its pixels depend on.
#pragma once

#include <cstdint>
#include <string>

namespace catoptric::run {

/// "Intel(R) Xeon(R) ..."; "unknown processor" where the system does not say.
std::string processorName();

/// The instruction sets that decide the last bits of pixels: "Embree avx512, x86-64-v4".
std::string instructionSets();

/// Fingerprint of the running program's file: a build.
std::string buildFingerprint();

std::uint64_t physicalMemoryBytes();

/// Host, processor, processors, memory, kernel, threads, version, compiler, as a JSON object.
std::string machineJson();

/// Version of the program.
const char* versionText();

}  // namespace catoptric::run
