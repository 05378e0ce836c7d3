// The rays of one tile against impostors: the nearest of them, rays that go on from reflective
// ones, and the environment map behind.
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "methods/shared/impostors/processor.h"

namespace catoptric::methods::impostors {

class TileRays {
 public:
  /// One for each thread, for all frames.
  static TileRays& ofThread();

  void begin(const ProcessorFrame& frame, ProcessorCounts& counts);
  /// To fill: x, y, depth, normal of `batch().count` samples of one reflector.
  Samples& samples() { return samples_; }
  RayBatch& batch() { return first_; }
  /// red, green, blue and marks of all rays of the batch.
  void run();

 private:
  void nearest(RayBatch& rays, bool diffuseAlone);
  /// The nearest first, as far as spheres about them tell.
  void meetInOrder(RayBatch& rays, std::span<const int> members);
  bool meet(RayBatch& rays, int index, const ImpostorLines& lines);
  void meetDepthMap(RayBatch& rays, const ImpostorLines& lines);
  void take(RayBatch& rays, int index, const ImpostorLines& lines);
  void shadeWalls(RayBatch& rays);
  /// Dims what was found by its distance.
  void fade(RayBatch& rays) const;
  void goOn();
  void followBatch();
  /// Adds what the environment map shows where nothing was met: to `rays`, and their marks.
  void addEnvironment(RayBatch& rays);
  const HalfImage& colorsOf(const ImpostorLines& lines) const;

  const ProcessorFrame* frame_ = nullptr;
  ProcessorCounts* counts_ = nullptr;
  trace::SampleCamera camera_{};
  float spread_ = 0.0f;
  Samples samples_;
  RayBatch first_;
  RayBatch second_;
  std::array<std::uint16_t, kMostRays>
      from_{};  ///< rays of first_ that those of second_ go on from
  std::array<float, kMostRays> specular_{};
  std::vector<std::pair<float, int>> order_;  ///< meetInOrder()'s: distance, impostor
  Meetings met_;
  MapRays map_;
  Vectors keptOrigins_;  ///< of rays that begin later
  Lane keptT_{};
  LookUps looks_;
  LookUps wider_;
  std::array<std::uint16_t, kMostRays> hits_{};  ///< rays that looks_ are of
  Lane width_{};
  Lane slant_{};
  EnvironmentLookUps around_;
};

}  // namespace catoptric::methods::impostors
