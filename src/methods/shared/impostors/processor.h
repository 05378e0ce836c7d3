// Reflected rays of mirrors against impostors on the processor: tiles of the G-buffer are read
// back, worked on by vector code, and written to the reflection. What impostors.glsl does on the
// device.
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

/// What rays need of an impostor, on the device and on the processor.
struct ImpostorLines {
  QuadLines quad;
  std::array<Vec4, 4> rows;  ///< Camera::rows()
  int layer = 0;
  int way = 0;  ///< shared::kWay...
  float texelMetres = 0.0f;
  bool plane = false;  ///< its image is one of those of objects' own planes
  bool reflective = false;
  int object = 0;  ///< id
  float height = 0.0f;
  float begin = 0.0f;  ///< metres along a ray from which on it is met
  float side = 1.0f;
  Vec3 tint{1.0f};
  // A sphere that holds it
  Vec3 centre{0.0f};
  float radius = 0.0f;
};

struct ProcessorCounts {
  std::uint64_t environment = 0;
  std::uint64_t secondOrder = 0;
  std::uint64_t transition = 0;
  std::uint64_t bent = 0;
  std::uint64_t clamped = 0;
  std::uint64_t work = 0;
  std::uint64_t clipped = 0;  ///< rays of which a depth map's planes leave nothing
  std::uint64_t culled = 0;   ///< of the rays against impostors those that a tile's bounds decide
  void add(const ProcessorCounts& other);
  /// A sample's, on the device or the processor.
  void addMarks(std::uint32_t marks);
};

/// Finds where rays meet the depth map of a layer: sets MapRays::at; returns the work.
using MeetMap = std::function<std::uint64_t(int layer, MapRays& rays)>;

struct ProcessorFrame {
  raster::GBuffer& gbuffer;
  const scene::Camera& camera;
  Box3 bounds;                              ///< of the scene
  const std::vector<std::uint8_t>& mirror;  ///< by object id
  std::vector<raster::Rectangle> parts;     ///< of the frame that show them
  const std::vector<ImpostorLines>& lines;
  const std::vector<ImpostorList>& lists;
  const std::vector<HalfImage>& images;   ///< by layer
  const std::vector<HalfImage>& normals;  ///< two by layer: normals, s
  const std::vector<HalfImage>& planes;
  const std::vector<HalfImage>& planeNormals;
  const HalfCube& cube;
  const MeetMap& meetMap;
  const Options& options;
  bool countsRays = false;  ///< the work is rays against impostors, not steps within maps
  bool masks = false;
  bool beside = false;  ///< other methods fill samples, too: they stay
  frame::StepTimer& timer;
};

class Processor {
 public:
  /// As steps `readback`, `intersect` and `upload`.
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

  // Kept from frame to frame, so that no frame allocates anew
  std::array<Band, 2> bands_;
};

}  // namespace catoptric::methods::impostors
