// Draws the G-buffer. Where little moves, only the changed parts are drawn, over a stored G-buffer
// of the still objects.
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

  /// See SceneRaster::drawGBuffer().
  DrawStatistics draw(GBuffer& target, const scene::Camera& camera, const frame::Lighting& lighting,
                      const std::optional<Region>& part, const frame::Geometry* geometry);
  /// See SceneRaster::drawStill().
  const GBuffer& drawStill(const GBuffer& like, const scene::Camera& camera,
                           const frame::Lighting& lighting, const Region& part,
                           const frame::Geometry& geometry, DrawStatistics* statistics);
  /// Drops what is stored for these objects (indices), because their vertices have changed.
  void forget(std::span<const int> changedObjects);

  /// The view of the last draw(), for the passes of methods.
  const FrameView& view() const { return view_; }

 private:
  static std::vector<gl::Define> backgroundDefines(const Materials& materials);
  /// Draws the samples of a G-buffer; if there are `parts`, only within them.
  DrawStatistics drawSamples(const GBuffer& target, std::span<const Rectangle> parts,
                             const frame::Lighting& lighting, Which which);
  /// As drawSamples(), but draws over the current contents, without clearing or background.
  DrawStatistics drawOver(std::span<const Rectangle> parts, const frame::Lighting& lighting,
                          Which which);
  /// Completes `covered_` for the still objects that it lacks.
  void findCovered(const scene::Camera& camera, const Rectangle& image,
                   const frame::Geometry& geometry);
  /// Sets `moving_`.
  void findMoving(const scene::Camera& camera, const Rectangle& image);

  /// The still objects as the camera of the last whole G-buffer sees them, in the requested tiles.
  struct StillSamples {
    GBuffer samples;
    Region drawn;
  };

  SceneGpu& scene_;
  Background background_;
  DrawList list_;
  FrameView view_;
  std::vector<CoveredSamples> covered_;  ///< indexed by object; for coveredCamera_
  scene::Camera coveredCamera_;
  Rectangle coveredImage_;
  std::optional<StillSamples> still_;
  std::optional<Region> moving_;  ///< where the last G-buffer may contain moving objects
};

}  // namespace catoptric::raster
