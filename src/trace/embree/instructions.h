// The instruction set that Embree uses on this machine.
#pragma once

#include <string>

namespace catoptric::trace {

/// Embree's own name of the instruction set: "avx512", "avx2", "avx", "sse4.2" or "sse2".
/// CATOPTRIC_EMBREE_ISA selects it; otherwise it is the best that both the processor and this build
/// of Embree support.
std::string embreeInstructions();

}  // namespace catoptric::trace
