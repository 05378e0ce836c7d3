// The method's options.
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
  /// Maximum number of sequences of reflectors, shorter ones first. Reflectors beyond them show
  /// their diffuse component. Not an option and not in the paper; tests change it.
  std::size_t maxPathTypes = 1024;
  float tracedPerPixel = 8.0f;
  std::uint64_t memoryBytes = std::uint64_t{1} << 30;  ///< maximum memory of virtual objects
  bool traceGaps = false;
};

const config::OptionTable<Options>& optionTable();

}  // namespace catoptric::methods::perturbation
