// The reflectors of a scene, by the sample classes of the G-buffer.
#pragma once

#include <cstddef>
#include <vector>

#include "frame/object_set.h"
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
  std::size_t count() const;           ///< number of reflectors
  std::vector<bool> reflects() const;  ///< by object index: whether the object is a reflector
};

/// Classifies the reflectors in `among`; other objects are Diffuse.
Reflectors findReflectors(const scene::Scene& scene, const frame::ObjectSet& among = {});

}  // namespace catoptric::methods
