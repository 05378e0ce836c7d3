#include "run/stage/steps.h"

namespace catoptric::run {

const std::vector<StepMeaning>& stepMeanings() {
  static const std::vector<StepMeaning> meanings = {
      {"scene", "start", "the scene description and its files are read and checked"},
      {"path", "start", "the camera path is read"},
      {"geometry", "start, frames",
       "vertices in world space; in a frame: moved to its time, where something can move"},
      {"environment", "start",
       "the environment's light is prepared (an image is read and integrated)"},
      {"bake", "start", "light or occlusion per vertex, computed or taken from the cache"},
      {"context", "start", "the OpenGL context is made"},
      {"programs", "start",
       "the shared shaders are compiled, meshes and textures put on the device"},
      {"bvh", "start, frames",
       "Embree's tree is built; in a frame: follows the geometry, by the method's policy"},
      {"allocate", "start", "memory of the G-buffer and the frame"},
      {"prepare", "start", "what a method prepares besides the steps that it names"},
      {"gbuffer", "frames", "diffuse radiance, normals, s, g, ids and depth are rasterized"},
      {"cube_map", "start, frames",
       "environment_map, second_order, perturbation: the cube map is drawn, again when something "
       "moved"},
      {"levels", "start", "second_order: coarser levels of objects are made"},
      {"cluster", "frames", "second_order: reflective samples are put into clusters"},
      {"camera", "frames", "second_order: each cluster gets a camera"},
      {"depth_images", "frames", "second_order: the scene is drawn as each cluster sees it"},
      {"intersect", "frames", "second_order: reflected rays are found in the depth images"},
      {"disocclusions", "frames",
       "second_order, perturbation with count_disocclusions: Embree's rays say which samples "
       "missed a "
       "surface"},
      {"paths", "frames",
       "perturbation: sparse rays meet the reflectors, the paths are expanded; again when the "
       "camera "
       "or a reflector moved"},
      {"virtual_objects", "frames",
       "perturbation: where the vertices of reflected objects appear; again for what moved"},
      {"virtual_draw", "frames",
       "perturbation: virtual objects are drawn, what they leave sees the environment"},
      {"trace", "frames", "traced: rays are traced; reference: the whole frame"},
      {"resolve", "frames",
       "environment_map: the look-up per sample; traced: light at the hits is computed and put in "
       "its place"},
      {"upload", "frames", "traced: reflections go back to the device"},
      {"composite", "frames", "diffuse and reflection are joined, samples resolved to pixels"},
      {"readback", "frames",
       "pixels are read from the device; traced, second_order: the G-buffer too"},
      {"layers", "frames", "asked-for layers and masks are read and resolved to pixels"},
      {"other", "frames", "the rest of the frame's time: what no step names"},
      {"wait", "frames",
       "the frame waits for the writers, the second also for what they load (not part of "
       "`rendering`)"},
      {"encode", "beside", "the EXR file is compressed"},
      {"preview", "beside", "the PNG preview is made"},
      {"write", "beside", "files are written, synced and renamed"},
  };
  return meanings;
}

}  // namespace catoptric::run
