// What of a scene reflects, in the classes of the G-buffer's samples.
#pragma once

#include <vector>

#include "raster/gbuffer.h"
#include "scene/scene.h"

namespace catoptric::methods {

struct Reflectors {
  std::vector<raster::SampleClass> classOf;  ///< by object id; [0] is the background
  bool planarMirrors = false;
  bool curvedMirrors = false;
  bool glossy = false;

  bool mirrors() const { return planarMirrors || curvedMirrors; }
  bool any() const { return mirrors() || glossy; }
};

Reflectors findReflectors(const scene::Scene& scene);

}  // namespace catoptric::methods
