#include "methods/shared/reflectors.h"

#include "raster/scene_gpu/materials.h"

namespace catoptric::methods {

Reflectors findReflectors(const scene::Scene& scene) {
  using raster::SampleClass;
  Reflectors found;
  found.classOf.push_back(SampleClass::Background);
  for (const scene::Object& object : scene.objects) {
    const SampleClass kind =
        raster::objectClass(raster::materialClass(scene, scene.materials[object.material]), object);
    found.classOf.push_back(kind);
    found.planarMirrors = found.planarMirrors || kind == SampleClass::PlanarMirror;
    found.curvedMirrors = found.curvedMirrors || kind == SampleClass::CurvedMirror;
    found.glossy = found.glossy || kind == SampleClass::Glossy;
  }
  return found;
}

}  // namespace catoptric::methods
