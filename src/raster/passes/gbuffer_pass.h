// Draws the G-buffer; where little moves, over what stands still.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "raster/gbuffer.h"
#include "raster/passes/background.h"
#include "raster/passes/visible.h"
#include "scene/camera.h"

namespace catoptric::raster {

class GBufferPass {
 public:
  explicit GBufferPass(SceneGpu& scene)
      : scene_(scene),
        background_("raster/shaders/gbuffer_background.frag",
                    backgroundDefines(scene.materials())) {}

  /// As SceneRaster::drawGBuffer().
  DrawStatistics draw(GBuffer& target, const scene::Camera& camera, const frame::Lighting& lighting,
                      const std::optional<Region>& part, const frame::Geometry* geometry);
  /// As SceneRaster::drawStill().
  const GBuffer& drawStill(const GBuffer& like, const scene::Camera& camera,
                           const frame::Lighting& lighting, const Region& part,
                           const frame::Geometry& geometry, DrawStatistics* statistics);
  /// The vertices of these objects (indices) have changed.
  void forget(std::span<const int> changedObjects);

  /// The view of the last draw(), for methods' own passes.
  const FrameView& view() const { return view_; }

 private:
  static std::vector<gl::Define> backgroundDefines(const Materials& materials);
  /// A G-buffer's samples; within `parts` where there are any.
  DrawStatistics drawSamples(const GBuffer& target, std::span<const Rectangle> parts,
                             const frame::Lighting& lighting, Which which);
  /// The same over what is there.
  DrawStatistics drawOver(std::span<const Rectangle> parts, const frame::Lighting& lighting,
                          Which which);
  /// Fills in what is missing of `covered_`, of what stands still.
  void findCovered(const scene::Camera& camera, const Rectangle& image,
                   const frame::Geometry& geometry);
  /// Notes `moving_`.
  void findMoving(const scene::Camera& camera, const Rectangle& image);

  /// What stands still as the last whole G-buffer's camera sees it, in tiles that were asked for.
  struct StillSamples {
    GBuffer samples;
    Region drawn;
  };

  SceneGpu& scene_;
  Background background_;
  DrawList list_;
  FrameView view_;
  std::vector<CoveredSamples> covered_;  ///< by object, seen by one camera
  scene::Camera coveredCamera_;
  Rectangle coveredImage_;
  std::optional<StillSamples> still_;
  std::optional<Region> moving_;  ///< where the last G-buffer may show what moves
};

}  // namespace catoptric::raster
