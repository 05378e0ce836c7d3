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
  std::size_t bounces = 1;
  /// Sequences of reflectors that are followed, shorter ones first; reflectors beyond them show
  /// their diffuse component. No option; ours. Tests change it.
  std::size_t maxPathTypes = 1024;
  float tracedPerPixel = 8.0f;
  std::uint64_t memoryBytes = std::uint64_t{1} << 30;  ///< of virtual objects
  bool traceGaps = false;
};

const config::OptionTable<Options>& optionTable();

}  // namespace catoptric::methods::perturbation
