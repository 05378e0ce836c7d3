#include "methods/shared/reflectors.h"

#include <algorithm>

#include "raster/scene_gpu/materials.h"

namespace catoptric::methods {

Reflectors findReflectors(const scene::Scene& scene, const frame::ObjectSet& among) {
  using raster::SampleClass;
  const std::vector<SampleClass> classes = raster::materialClasses(scene);
  Reflectors found;
  found.classOf.push_back(SampleClass::Background);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const SampleClass kind = !among.contains(static_cast<int>(i))
                                 ? SampleClass::Diffuse
                                 : raster::objectClass(classes[object.material], object);
    found.classOf.push_back(kind);
    found.planarMirrors = found.planarMirrors || kind == SampleClass::PlanarMirror;
    found.curvedMirrors = found.curvedMirrors || kind == SampleClass::CurvedMirror;
    found.glossy = found.glossy || kind == SampleClass::Glossy;
  }
  return found;
}

std::size_t Reflectors::count() const {
  return static_cast<std::size_t>(std::ranges::count_if(classOf, [](raster::SampleClass kind) {
    return kind != raster::SampleClass::Background && kind != raster::SampleClass::Diffuse;
  }));
}

std::vector<bool> Reflectors::reflects() const {
  std::vector<bool> objects;
  for (std::size_t id = 1; id < classOf.size(); ++id)
    objects.push_back(classOf[id] != raster::SampleClass::Background &&
                      classOf[id] != raster::SampleClass::Diffuse);
  return objects;
}

}  // namespace catoptric::methods
