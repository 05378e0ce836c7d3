// Intersects the rays of one tile with impostors: finds the nearest hits, continues rays from
// reflective impostors, and adds the environment map.
#pragma once

#include <array>
#include <span>
#include <tuple>
#include <vector>

#include "methods/shared/impostors/processor.h"

namespace catoptric::methods::impostors {

class TileRays {
 public:
  /// The instance of the calling thread, which is reused for all frames.
  static TileRays& ofThread();

  void begin(const ProcessorFrame& frame, ProcessorCounts& counts);
  /// Input of run(): x, y, depth, normal of `batch().count` samples of one reflector.
  Samples& samples() { return samples_; }
  RayBatch& batch() { return first_; }
  /// Sets colour and marks (mask bits, kMarkSecond) of all rays of the batch.
  void run();

 private:
  void nearest(RayBatch& rays, bool diffuseAlone);
  /// Tests nearer impostors first, in the order of their bounding spheres.
  void meetInOrder(RayBatch& rays, const ImpostorList& list, std::size_t count);
  bool meet(RayBatch& rays, int index, const ImpostorLines& lines);
  void meetDepthMap(RayBatch& rays, const ImpostorLines& lines);
  /// Intersects rays with several depth maps of one object. A ray is tested first against the map
  /// whose direction is nearest to its own; if it passes behind an edge there, against the next.
  bool meetViews(RayBatch& rays, std::span<const int> views);
  void take(RayBatch& rays, int index, const ImpostorLines& lines);
  void shadeWalls(RayBatch& rays);
  /// Attenuates the radiance of hits by their distance.
  void fade(RayBatch& rays) const;
  void goOn();
  void followBatch();
  /// Adds the environment map to the rays that hit nothing, and sets their marks.
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
      from_{};  ///< rays of first_ from which those of second_ continue
  std::array<float, kMostRays> specular_{};
  std::vector<std::tuple<float, int, int>> order_;  ///< distance, impostor, place in the list
  Meetings met_;
  MapRays map_;
  // Within meetViews(): whether a ray is tested against the present map (wanted_), and the distance
  // from which on it is behind an edge of this map (hidden_; 0: nowhere)
  bool several_ = false;
  Lane hidden_{};
  std::array<bool, kMostRays> wanted_{};
  // The original origins and hit distances of rays, kept while the rays start at
  // ImpostorLines::begin
  Vectors keptOrigins_;
  Lane keptT_{};
  LookUps looks_;
  LookUps wider_;
  std::array<std::uint16_t, kMostRays> hits_{};  ///< rays of the look-ups in looks_
  Lane width_{};
  Lane slant_{};
  EnvironmentLookUps around_;
};

}  // namespace catoptric::methods::impostors
