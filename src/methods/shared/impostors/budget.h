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

/// The cost of images: memory, and time. The unit of time is that of drawing one texel of a
/// billboard.
struct Cost {
  std::uint64_t bytes = 0;
  double texels = 0.0;

  void add(const Cost& other) {
    bytes += other.bytes;
    texels += other.texels;
  }
  bool within(const Cost& most) const { return bytes <= most.bytes && texels <= most.texels; }
};

/// The limit on Cost::texels of all images of a frame, so that the frame takes at most about 1.5
/// times as long as with tracing. `samples`: samples of the frame; `rays`: rays that tracing takes.
double allowedTexels(std::uint64_t samples, std::uint64_t rays);

/// What intersecting `rays` takes in excess of tracing them, as texels; at least 0.
double beyondTracing(double texels, std::uint64_t rays);

/// A reflector that a frame shows.
struct Wish {
  int reflector = 0;        ///< index of the object
  std::uint64_t rays = 0;   ///< rays that tracing the reflector would take
  double texels = 0.0;      ///< additional time of intersecting its rays, compared with tracing
  std::vector<int> images;  ///< the impostors that its rays may meet, each once
};

/// Returns for each wish whether all its images are granted. `costs`: by impostor; `most`: limit
/// for all granted images together. Wishes with more rays per cost are granted first.
std::vector<bool> grant(std::span<const Wish> wishes, std::span<const Cost> costs,
                        const Cost& most);

/// A sphere that contains all points at which rays can hit an impostor.
struct Reach {
  Vec3 centre{0.0f};
  float radius = 0.0f;
  bool depth = false;  ///< the impostor is a depth map
};

/// The samples of a frame that show reflectors, and the impostors that their rays may meet.
class Demand {
 public:
  /// The rays of a reflector that look for impostors: none, mirrored rays, or rays in any
  /// direction.
  enum class Rays : std::uint8_t { None, Mirrored, Any };

  /// `raysOf`: by object; `lists`, `reaches`: by object and by impostor; they must outlive this.
  Demand(const raster::GBufferCopy& samples, const scene::Camera& camera,
         std::span<const Rays> raysOf, std::span<const ImpostorList> lists,
         std::span<const Reach> reaches);

  std::uint64_t samplesOf(int object) const {
    return samplesOf_[static_cast<std::size_t>(object)].load();
  }
  /// Pairs of a mirrored ray and an object with depth maps that the ray may meet; 0 unless
  /// Rays::Mirrored.
  std::uint64_t testsOf(int object) const {
    return testsOf_[static_cast<std::size_t>(object)].load();
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
  std::vector<std::size_t> firstOf_;  ///< by object: index of its first entry in met_
  std::vector<std::atomic<std::uint64_t>> samplesOf_;
  std::vector<std::atomic<std::uint64_t>> testsOf_;
  std::vector<std::atomic<bool>> met_;
};

}  // namespace catoptric::methods::impostors
