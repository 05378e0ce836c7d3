#include "methods/perturbation/kinds.h"

#include "raster/scene_gpu/materials.h"

namespace catoptric::methods::perturbation {

Kind kindOf(const scene::Scene& scene, const scene::Object& object, std::string& reason) {
  const scene::Material& material = scene.materials[object.material];
  const raster::SampleClass kind = raster::materialClass(scene, material);
  // One that a mask cuts is a mesh (frame::Geometry)
  const bool surface =
      scene.meshes[object.mesh].surface && material.alphaMode != scene::AlphaMode::Mask;
  if (kind == raster::SampleClass::Diffuse) return Kind::Diffuse;
  if (kind == raster::SampleClass::Glossy) {
    reason = "is glossy (g above 0.05); perturbation renders only mirrors";
  } else if (material.normalTexture.used()) {
    reason = "has a normal map";
  } else if (material.refraction > 0.0f && !surface) {
    reason = "refracts, but is not an implicit surface";
  } else if (object.planar && !(material.refraction > 0.0f)) {
    return Kind::Planar;
  } else if (surface) {
    return Kind::Implicit;
  } else {
    reason =
        "is a curved mesh; mirrors must be planar or implicit surfaces without \"alpha_cutoff\" (a "
        "ball: \"shape\": \"implicit\", \"surface\": \"sphere\")";
  }
  return Kind::Unsupported;
}

}  // namespace catoptric::methods::perturbation
