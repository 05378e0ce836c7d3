// The pass `intersect`: radiance along the reflected rays of all samples, from the depth images of
// their clusters, and from the cube map and the sky for rays that find nothing.
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

/// What a frame's rays are intersected with.
struct RayInputs {
  const scene::Camera& camera;
  const DepthImages& images;
  const CubeMap& cubeMap;
  /// All samples of planar mirrors are looked up in mirrored grids; else they are walked like those
  /// of curved mirrors.
  bool onGrids = true;
  bool exactGrids = false;  ///< these have a texel for each sample
};

class RayPass {
 public:
  /// Compiles the programs that most frames need; the others with the first frame that does.
  RayPass(const Options& options, const SceneReflectors& reflectors, const Services& services,
          const RunSettings& settings);

  /// The cluster of each sample (Clustering::clusterOf()), kept until run() is done.
  void setClusters(std::span<const std::uint16_t> clusterOf);
  /// Fills the reflection of every sample, and its marks.
  void run(Services& services, const RayInputs& inputs);

  /// The counts of the last run; `unclustered`: samples in no cluster, which see the cube map.
  void count(std::uint64_t unclustered, Counters& counters) const;
  /// Samples whose lobes see what is brighter than white, where the options have probes.
  bool anySeesLamp() const { return markCounts_.back() > 0; }
  bool seesLamp(std::size_t sample) const {
    return ((masks_.empty() ? marks_[sample] : masks_[sample]) & raster::kMaskRetraced) != 0;
  }
  /// What each sample's rays found, where the options count disocclusions.
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
  bool lobeHorizons_ = false;  ///< the G-buffer has them
  bool ggx_ = false;           ///< some lobes are GGX'
  gl::Program glossy_;
  gl::Program lookUps_;
  gl::Texture clusterSamples_;
  bool sharesFrame_ = false;  ///< with other methods
  bool countDisocclusions_ = false;
  std::span<const std::uint16_t> clusterOf_;  ///< of the frame at hand
  gl::Buffer counts_;
  gl::Buffer foundBuffer_;
  std::vector<FoundByRays> found_;
  gl::Texture ownMarks_;  ///< as GBuffer::masks, where there are none
  gl::Framebuffer ownTarget_;
  std::vector<std::uint8_t> marks_;        ///< where no masks are asked for
  std::vector<std::uint16_t> masks_;       ///< where they are
  std::vector<std::uint64_t> markCounts_;  ///< of each mark that is counted
  int tilesAcross_ = 0;
  int tilesDown_ = 0;
  std::vector<std::uint32_t> later_;  ///< tiles with a sample that is still to be looked up
  gl::Buffer tiles_;                  ///< these
  gl::Texture tileTexture_;
};

}  // namespace catoptric::methods::second_order
