// Which reflectors of a frame have impostors: those whose images fit into memory and are not much
// dearer than tracing the rays of the samples that show them.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "methods/shared/impostors/choice.h"
#include "raster/gbuffer.h"
#include "scene/camera.h"

namespace catoptric::methods::impostors {

/// What images take: memory, and time in the time in which a billboard's texel is drawn.
struct Cost {
  std::uint64_t bytes = 0;
  double texels = 0.0;

  void add(const Cost& other) {
    bytes += other.bytes;
    texels += other.texels;
  }
  bool within(const Cost& most) const { return bytes <= most.bytes && texels <= most.texels; }
};

/// Texels that the images of a frame may cost, so that it takes at most about 1.5 times as long as
/// tracing: a frame of so many samples, in which so many rays are traced.
double allowedTexels(std::uint64_t samples, std::uint64_t rays);

/// A reflector that a frame shows.
struct Wish {
  int reflector = 0;        ///< index of the object
  std::uint64_t rays = 0;   ///< that tracing it would take
  double texels = 0.0;      ///< time to intersect its rays beyond that of tracing them
  std::vector<int> images;  ///< the impostors that its rays may meet, each once
};

/// By wish: whether all its images are granted. `costs`: by impostor; `most`: of all granted images
/// together. Those come first whose images serve most rays.
std::vector<bool> grant(std::span<const Wish> wishes, std::span<const Cost> costs,
                        const Cost& most);

/// A sphere that contains all places where rays can meet an impostor.
struct Reach {
  Vec3 centre{0.0f};
  float radius = 0.0f;
};

/// The samples of a frame that show reflectors, and the impostors that their rays may meet.
class Demand {
 public:
  /// How a reflector's rays are known: none asks; a mirror's rays; any direction.
  enum class Rays : std::uint8_t { None, Mirrored, Any };

  /// `raysOf`: by object; `lists`, `reaches`: by object and by impostor; they must outlive this.
  Demand(const raster::GBufferCopy& samples, const scene::Camera& camera,
         std::span<const Rays> raysOf, std::span<const ImpostorList> lists,
         std::span<const Reach> reaches);

  std::uint64_t samplesOf(int object) const {
    return samplesOf_[static_cast<std::size_t>(object)].load();
  }
  /// The part of a reflector's list that its rays may meet.
  ImpostorList listOf(int object) const;

 private:
  struct Tile;
  void lookAt(const Tile& tile);
  void ask(std::size_t object, const struct RayBatch& rays);

  std::span<const Rays> raysOf_;
  std::span<const ImpostorList> lists_;
  std::span<const Reach> reaches_;
  std::vector<std::size_t> firstOf_;  ///< by object: of its members in met_
  std::vector<std::atomic<std::uint64_t>> samplesOf_;
  std::vector<std::atomic<bool>> met_;
};

}  // namespace catoptric::methods::impostors
