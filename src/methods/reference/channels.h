// Where the reference's image has its layers.
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "methods/contract/layers.h"

namespace catoptric::methods {

/// First channels of the layers, in the order of the rasterizing methods' layers
/// (run/stage/method_source.cpp); -1: the image does not have the layer.
struct Channels {
  std::vector<std::string> names;
  int z = -1, normal = -1, reflection = -1, diffuse = -1, s = -1, id = -1, masks = -1;
  int oneBounce = -1, error = -1;

  Channels() = default;
  Channels(const RunSettings& settings, bool hasError, bool hasOneBounce) {
    add({"R", "G", "B", "A"});
    if (asksFor(settings, "Z")) z = add({"Z"});
    if (asksFor(settings, "N")) normal = add({"N.X", "N.Y", "N.Z"});
    if (asksFor(settings, "reflection"))
      reflection = add({"reflection.R", "reflection.G", "reflection.B"});
    if (asksFor(settings, "diffuse")) diffuse = add({"diffuse.R", "diffuse.G", "diffuse.B"});
    if (asksFor(settings, "s")) s = add({"s"});
    if (asksFor(settings, "id")) id = add({"id.object"});
    if (settings.masks)
      masks = add({"mask.environment", "mask.below_horizon", "mask.sky", "mask.reflective"});
    if (hasOneBounce) oneBounce = add({"one_bounce.R", "one_bounce.G", "one_bounce.B"});
    if (hasError) error = add({"standard_error.R", "standard_error.G", "standard_error.B"});
  }

 private:
  int add(std::initializer_list<const char*> more) {
    const int first = static_cast<int>(names.size());
    names.insert(names.end(), more.begin(), more.end());
    return first;
  }
};

}  // namespace catoptric::methods
