// Clusters whose depth images err, and their way through Embree instead: a few rays of each are
// traced, to see which meet their own object, and whether what the images show is what is there.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frame/shading.h"
#include "gl/objects.h"
#include "gl/shader.h"
#include "methods/contract/method.h"
#include "methods/second_order/clustering/clusters.h"
#include "methods/second_order/options.h"
#include "methods/second_order/ray_pass.h"
#include "methods/shared/sample_tiles.h"
#include "trace/embree/trace_scene.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods::second_order {

/// What the probes of a cluster say of it.
struct Probed {
  std::uint32_t asked = 0;
  std::uint32_t own = 0;  ///< whose (first) ray met the cluster's own object
  double error = 0.0;     ///< sum of differences, of 255 steps of the display
  double selfHitShare() const { return asked > 0 ? static_cast<double>(own) / asked : 0.0; }
  double meanError() const { return asked > 0 ? error / asked : 0.0; }
};

class Retrace {
 public:
  Retrace(const Options& options, const RunSettings& settings, const scene::Scene& scene);

  /// Traces up to Options::probes samples of each curved cluster that is not left to
  /// tracing already, evenly spread over it.
  /// The same for any number of threads.
  void probe(const FrameInput& input, Services& services, const raster::GBufferCopy& gbuffer,
             const Clustering& clustering);
  /// Compares what GBuffer::reflection shows at the probes with what they saw. `weight`: by object
  /// id, what reflections are multiplied with at most. Large clusters are judged in cells.
  void compare(const raster::GBuffer& gbuffer, std::span<const Cluster> clusters,
               std::span<const float> weight);
  /// Whether a cluster, or one of its cells, differs from its probes by more than is allowed.
  bool errs(std::size_t cluster) const;
  /// Whether an object's samples are mirrored here, which Embree does not do: it has no probes.
  bool refracts(std::size_t object) const { return refracts_[object]; }
  /// Of each cluster; of a planar mirror and of what is traced already nothing.
  std::span<const Probed> probed() const { return probed_; }

  /// Traces the samples of all clusters with Cluster::traced, of cells that err, and of
  /// tiles that see lamps, and writes what they see to GBuffer::reflection and, where masks are
  /// asked for, GBuffer::masks.
  struct Done {
    trace::ReflectionCounts rays;
    std::uint64_t samples = 0;
    std::uint64_t belowHorizon = 0;  ///< of samples that were not searched
  };
  Done run(const FrameInput& input, Services& services, const raster::GBufferCopy& gbuffer,
           const Clustering& clustering, const RayPass& shown);

 private:
  struct Probe {
    std::uint32_t cluster;
    std::uint16_t x, y;
  };
  void choose(const Clustering& clustering);
  std::size_t cellOf(std::uint32_t cluster, std::size_t x, std::size_t y) const {
    return cluster * cellsAcross_ * cellsDown_ + y / kCell * cellsAcross_ + x / kCell;
  }
  bool errs(const Probed& cell) const {
    return cell.asked >= kLeastProbes && cell.meanError() > probeError_;
  }
  bool traces(const Clustering& clustering, std::size_t at, std::size_t x, std::size_t y,
              bool byLamp) const;
  void readRows(const raster::GBuffer& gbuffer, const SampleTiles& tiles,
                const Clustering& clustering, const RayPass& shown);
  void put(const SampleTiles::Members& members, const Vec3* radiance, const std::uint8_t* flags);
  void upload(raster::GBuffer& gbuffer) const;

  static constexpr std::size_t kCell = 64;          ///< samples a side. Ours.
  static constexpr std::uint32_t kLeastProbes = 4;  ///< that a cell needs to be judged. Ours.

  int most_;  ///< probes of a cluster, and of a whole cell of a large one
  float probeError_;
  trace::ReflectionOptions options_;
  frame::ObjectSet own_;  ///< reflectors that the method fills
  bool masks_;
  std::vector<bool> refracts_;  ///< by object id
  std::vector<Probe> probes_;
  std::vector<Vec3> seen_;  ///< by the probes
  std::vector<Probed> probed_;
  std::size_t cellsAcross_ = 0, cellsDown_ = 0;
  std::vector<std::uint32_t> largeOf_;  ///< by cluster: number among the large ones, or kNotLarge
  static constexpr std::uint32_t kNotLarge = 0xFFFFFFFFu;
  std::vector<Probed> cells_;  ///< of large clusters, by cellOf() of that number
  // To read the reflection at the probes alone
  gl::Program gather_;
  gl::Buffer places_;
  gl::Texture placeTexture_;
  gl::Texture gathered_;
  gl::Framebuffer target_;
  // What is traced, in rows of tiles that are uploaded
  std::vector<std::uint8_t> rowTraced_;
  std::vector<std::uint8_t> byLamp_;  ///< tiles of which a sample sees a lamp
  std::vector<float> image_;          ///< 4 a sample
  std::vector<std::uint16_t> maskImage_;
};

}  // namespace catoptric::methods::second_order
