// The method's options, as a run config has them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "config/options.h"
#include "methods/perturbation/reflector.h"
#include "methods/perturbation/virtual_objects.h"

namespace catoptric::methods::perturbation {

struct Options {
  PathOptions path;
  TriangleOptions triangles;
  std::size_t maxBounces = 1;
  std::size_t maxPathTypes = 1024;
  float tracedPerPixel = 8.0f;
  std::uint64_t memoryBytes = std::uint64_t{1} << 30;  ///< of virtual objects
  bool traceGaps = false;
  bool countDisocclusions = false;
};

const config::OptionTable<Options>& optionTable();

}  // namespace catoptric::methods::perturbation
