// Intersects reflected rays of mirrors with impostors on the CPU. Tiles of the G-buffer are read
// back, processed with vector code, and written to the reflection. The counterpart of
// impostors.glsl.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "frame/steps.h"
#include "methods/shared/impostors/choice.h"
#include "methods/shared/impostors/half_image.h"
#include "methods/shared/impostors/options.h"
#include "methods/shared/impostors/ray_batch.h"
#include "raster/gbuffer.h"
#include "raster/regions/rectangle.h"
#include "scene/camera.h"

namespace catoptric::methods::impostors {

/// The data of an impostor that rays need, on GPU and CPU.
struct ImpostorLines {
  QuadLines quad;
  std::array<Vec4, 4> rows;  ///< Camera::rows()
  int layer = 0;
  int way = 0;  ///< shared::kWay...
  float texelMetres = 0.0f;
  bool plane = false;  ///< the image shows one of an object's planes
  bool reflective = false;
  int object = 0;  ///< id
  float height = 0.0f;
  float begin = 0.0f;  ///< rays can hit the impostor only beyond this distance, in metres
  float side = 1.0f;
  float steepest = 0.0f;  ///< MapRays::steepest, if the object has several depth maps
  Vec3 tint{1.0f};
  // A sphere that contains the impostor
  Vec3 centre{0.0f};
  float radius = 0.0f;
};

struct ProcessorCounts {
  std::uint64_t environment = 0;
  std::uint64_t secondOrder = 0;
  std::uint64_t transition = 0;
  std::uint64_t bent = 0;
  std::uint64_t clamped = 0;
  std::uint64_t disoccluded = 0;
  std::uint64_t work = 0;
  std::uint64_t clipped = 0;   ///< pairs of a ray and a depth map whose frustum the ray misses
  std::uint64_t searched = 0;  ///< the other pairs of a ray and a depth map
  std::uint64_t texels = 0;    ///< MapRays::texels of these
  std::uint64_t culled = 0;    ///< pairs of a ray and an impostor that is not tested
  void add(const ProcessorCounts& other);
  /// Adds the marks of a sample, from GPU or CPU.
  void addMarks(std::uint32_t marks);
};

/// Intersects rays with the depth map of a layer: sets MapRays::at and returns the amount of work.
using MeetMap = std::function<std::uint64_t(int layer, MapRays& rays)>;

struct ProcessorFrame {
  raster::GBuffer& gbuffer;
  const scene::Camera& camera;
  Box3 bounds;                              ///< of the scene
  const std::vector<std::uint8_t>& mirror;  ///< by object id; 1: a mirror to shade
  std::vector<raster::Rectangle> parts;     ///< parts of the frame that show mirrors
  const std::vector<ImpostorLines>& lines;
  const std::vector<ImpostorList>& lists;
  const std::vector<HalfImage>& images;   ///< by layer
  const std::vector<HalfImage>& normals;  ///< two per layer: normals, s
  const std::vector<HalfImage>& planes;
  const std::vector<HalfImage>& planeNormals;
  const HalfCube& cube;
  const MeetMap& meetMap;
  const Options& options;
  bool countsRays = false;  ///< count tests of rays against impostors instead of steps in maps
  bool masks = false;
  bool beside = false;  ///< other methods shade some samples, which must not be changed
  frame::StepTimer& timer;
};

class Processor {
 public:
  /// Runs the steps `readback`, `intersect` and `upload`.
  ProcessorCounts run(const ProcessorFrame& frame);

 private:
  class Tiles;
  struct Band {
    raster::Rectangle place;
    std::vector<float> normal;
    std::vector<float> depth;
    std::vector<std::uint32_t> object;
    std::vector<float> image;
    std::vector<std::uint16_t> masks;
  };
  void read(const ProcessorFrame& frame, const raster::Rectangle& place, Band& band) const;
  static void upload(const ProcessorFrame& frame, const Band& band);
  static ProcessorCounts intersect(const ProcessorFrame& frame, Band& band);

  // Kept from frame to frame to avoid allocations
  std::array<Band, 2> bands_;
};

}  // namespace catoptric::methods::impostors
