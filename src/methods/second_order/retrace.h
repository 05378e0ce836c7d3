// Finds clusters whose depth images are inaccurate, and traces them with Embree. For that a few
// rays of each cluster are traced (probes), and compared with the image.
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

/// Results of a cluster's probes.
struct Probed {
  std::uint32_t asked = 0;
  std::uint32_t own = 0;  ///< probes whose (first) ray hit the cluster's own object
  double error = 0.0;     ///< sum of differences in display steps (0..255)
  double selfHitShare() const { return asked > 0 ? static_cast<double>(own) / asked : 0.0; }
  double meanError() const { return asked > 0 ? error / asked : 0.0; }
};

class Retrace {
 public:
  Retrace(const Options& options, const RunSettings& settings, const scene::Scene& scene);

  /// Traces up to Options::probes samples of each curved cluster that is not already traced, evenly
  /// spread over it. The result does not depend on the number of threads.
  void probe(const FrameInput& input, Services& services, const raster::GBufferCopy& gbuffer,
             const Clustering& clustering);
  /// Compares GBuffer::reflection at the probes with the traced radiance. `weight`: by object id,
  /// maximum weight of reflections. Large clusters are judged in cells.
  void compare(const raster::GBuffer& gbuffer, std::span<const Cluster> clusters,
               std::span<const float> weight);
  /// Whether a cluster, or one of its cells, differs too much from its probes.
  bool errs(std::size_t cluster) const;
  /// By object id: whether its samples may be traced. Those of refractive objects may not, because
  /// this method shades them as mirrors and Embree does not.
  const std::vector<bool>& traceable() const { return traceable_; }
  /// One entry per cluster; empty for planar mirrors and for clusters that are already traced.
  std::span<const Probed> probed() const { return probed_; }

  /// Counts of run().
  struct Done {
    trace::ReflectionCounts rays;
    std::uint64_t samples = 0;
    /// Rays below the horizon, only of samples with Clustering::kRetraced.
    std::uint64_t belowHorizon = 0;
  };
  /// Traces all samples with Clustering::kRetraced, of clusters with Cluster::retraced those in
  /// cells with too large an error, and those of tiles with samples that see lamps. Writes
  /// GBuffer::reflection and, if requested, GBuffer::masks.
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

  static constexpr std::size_t kCell = 64;          ///< edge length in samples; not from the paper
  static constexpr std::uint32_t kLeastProbes = 4;  ///< per judged cell; not from the paper

  int most_;  ///< maximum number of probes of a cluster, and of a full cell of a large cluster
  float probeError_;
  trace::ReflectionOptions options_;
  frame::ObjectSet own_;  ///< reflectors that the method shades
  bool masks_;
  std::vector<bool> traceable_;
  std::vector<Probe> probes_;
  std::vector<Vec3> seen_;  ///< traced radiance of the probes
  std::vector<Probed> probed_;
  std::size_t cellsAcross_ = 0, cellsDown_ = 0;
  /// By cluster: index among the large clusters, or kNotLarge.
  std::vector<std::uint32_t> largeOf_;
  static constexpr std::uint32_t kNotLarge = 0xFFFFFFFFu;
  std::vector<Probed> cells_;  ///< of large clusters; index: cellOf()
  // To read the reflection only at the probes
  gl::Program gather_;
  gl::Buffer places_;
  gl::Texture placeTexture_;
  gl::Texture gathered_;
  gl::Framebuffer target_;
  // The traced samples, in rows of tiles that are uploaded
  std::vector<std::uint8_t> rowTraced_;
  std::vector<std::uint8_t> byLamp_;  ///< tiles with a sample that sees a lamp
  std::vector<float> image_;          ///< 4 values per sample
  std::vector<std::uint16_t> maskImage_;
};

}  // namespace catoptric::methods::second_order
