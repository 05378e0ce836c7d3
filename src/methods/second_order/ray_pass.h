// The pass `intersect` computes the radiance along the reflected rays of all samples from the depth
// images of their clusters. Rays that hit nothing there receive the radiance of the cube map and
// the sky.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "gl/objects.h"
#include "gl/shader.h"
#include "methods/contract/method.h"
#include "methods/second_order/depth_images/depth_images.h"
#include "methods/second_order/disocclusions.h"
#include "methods/second_order/options.h"
#include "methods/second_order/reflectors.h"
#include "methods/shared/cube_map.h"

namespace catoptric::methods::second_order {

/// The input of the pass for one frame.
struct RayInputs {
  const scene::Camera& camera;
  const DepthImages& images;
  const CubeMap& cubeMap;
  /// Whether all samples of planar mirrors are read from mirrored grids. Otherwise rays are
  /// marched, as for curved mirrors.
  bool onGrids = true;
  bool exactGrids = false;  ///< the mirrored grids have one texel per sample
};

class RayPass {
 public:
  /// Compiles the shaders that most frames need; the others are compiled when first needed.
  RayPass(const Options& options, const SceneReflectors& reflectors, const Services& services,
          const RunSettings& settings);

  /// Sets the cluster of each sample (Clustering::clusterOf()); must be valid until run() ends.
  void setClusters(std::span<const std::uint16_t> clusterOf);
  /// Sets the reflection of every sample, and its mark bits (shaders/marks.glsl).
  void run(Services& services, const RayInputs& inputs);

  /// Adds the counts of the last run. `unclustered`: samples in no cluster.
  void count(std::uint64_t unclustered, Counters& counters) const;
  /// Whether lobes of any sample hit surfaces brighter than white; only known with probes.
  bool anySeesLamp() const { return markCounts_.back() > 0; }
  bool seesLamp(std::size_t sample) const {
    return ((masks_.empty() ? marks_[sample] : masks_[sample]) & raster::kMaskRetraced) != 0;
  }
  /// The hits of each sample's rays, if the options count disocclusions.
  std::span<const FoundByRays> readFound();

 private:
  gl::Program walkProgram(const Services& services, bool lobes) const;
  void bindSamples(gl::Program& program, const Services& services, const RayInputs& inputs) const;
  void bindWalk(gl::Program& program, const Services& services, const RayInputs& inputs) const;
  void bindFallback(gl::Program& program, const Services& services, const RayInputs& inputs) const;
  gl::Program& curved(const Services& services);
  gl::Program& planar(bool exact);
  void followRays(Services& services, const RayInputs& inputs);
  template <class Marks>
  void takeMarks(const gl::Texture& texture, GLenum type, std::vector<Marks>& marks);
  void lookUp(Services& services, const RayInputs& inputs);

  Options options_;
  SceneReflectors reflectors_;
  gl::Program planarExact_;
  gl::Program planarScaled_;
  gl::Program curved_;
  bool lobeHorizons_ = false;  ///< the G-buffer has lobe horizons
  bool ggx_ = false;           ///< some lobes are GGX lobes
  gl::Program glossy_;
  gl::Program lookUps_;
  gl::Texture clusterSamples_;
  bool sharesFrame_ = false;  ///< other methods shade some reflectors
  bool countDisocclusions_ = false;
  std::span<const std::uint16_t> clusterOf_;  ///< of the current frame
  gl::Buffer counts_;
  gl::Buffer foundBuffer_;
  std::vector<FoundByRays> found_;
  gl::Texture ownMarks_;  ///< used instead of GBuffer::masks if no masks are requested
  gl::Framebuffer ownTarget_;
  std::vector<std::uint8_t> marks_;        ///< if no masks are requested
  std::vector<std::uint16_t> masks_;       ///< if masks are requested
  std::vector<std::uint64_t> markCounts_;  ///< number of samples with each counted mark
  int tilesAcross_ = 0;
  int tilesDown_ = 0;
  std::vector<std::uint32_t> later_;  ///< tiles with samples that are not yet shaded
  gl::Buffer tiles_;                  ///< later_ on the GPU
  gl::Texture tileTexture_;
};

}  // namespace catoptric::methods::second_order
