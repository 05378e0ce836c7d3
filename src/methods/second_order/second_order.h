// The method second_order [Wang2014]: clusters of reflected rays, a depth image for each cluster,
// and ray marching in these images.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "methods/contract/method.h"
#include "methods/second_order/clustering/clusters.h"
#include "methods/second_order/depth_images/depth_images.h"
#include "methods/second_order/options.h"
#include "methods/second_order/ray_pass.h"
#include "methods/second_order/reflectors.h"
#include "methods/second_order/retrace.h"
#include "methods/shared/cube_map.h"
#include "raster/passes/refractive_samples.h"

namespace catoptric::methods::second_order {

class SecondOrder : public Method {
 public:
  explicit SecondOrder(const Options& options) : options_(options) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override;
  void prepare(Services& services, const RunSettings& settings) override;
  void render(const FrameInput& input, Services& services, FrameOutput& output) override;

 private:
  void leaveSmallOnes(Counters& counters);
  void traceWhatSeesItself(const FrameInput& input, Services& services,
                           std::vector<ClusterCamera>& cameras, Counters& counters);
  void retraceWhatErrs(const FrameInput& input, Services& services, Counters& counters);
  std::vector<ClusterCamera> makeCameras(Services& services, const scene::Camera& camera,
                                         float& scale, Counters& counters);
  void countDisocclusions(Services& services, const scene::Camera& camera,
                          std::span<const ClusterCamera> cameras, FrameOutput& output);
  void report(const std::vector<ClusterCamera>& cameras,
              const std::vector<std::uint64_t>& triangles, FrameOutput& output) const;

  Options options_;
  RunSettings settings_;
  SceneReflectors reflectors_;
  raster::RefractiveSamples refractive_;
  raster::GBufferCopy copy_;
  Clustering clustering_;
  std::uint64_t tracedBelowHorizon_ = 0;  ///< rays of samples with Clustering::kRetraced
  std::unique_ptr<Retrace> retrace_;      ///< null if clusters are not probed
  std::unique_ptr<DepthImages> images_;
  CubeMap cubeMap_;
  std::unique_ptr<RayPass> rayPass_;
};

}  // namespace catoptric::methods::second_order

namespace catoptric::methods {

const MethodEntry& secondOrderEntry();

}  // namespace catoptric::methods
