// The instruction set that Embree uses on this machine.
#pragma once

#include <string>

namespace catoptric::trace {

/// By Embree's own names: "avx512", "avx2", "avx", "sse4.2" or "sse2". What CATOPTRIC_EMBREE_ISA
/// names, or else the best that the processor and this build of Embree have.
std::string embreeInstructions();

}  // namespace catoptric::trace
