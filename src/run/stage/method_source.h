// Renders the frames of one method: G-buffer, the method's passes, composite, readback.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "methods/contract/method.h"
#include "run/sequence/sequence.h"
#include "run/stage/layers.h"
#include "run/stage/stage.h"

namespace catoptric::run {

class MethodSource : public FrameSource {
 public:
  /// `stage` must outlive this. Several sources may use the same stage one after the other.
  MethodSource(Stage& stage, methods::Method& method, const methods::MethodPlan& needs);
  ~MethodSource() override;

  std::vector<frame::StepSample> prepare() override;
  RenderedFrame render(const FrameRequest& request) override;
  std::map<std::string, std::string> context() const override;

 private:
  /// Moves the scene to the frame's time, and sets in `input` what has changed.
  void moveTo(methods::FrameInput& input);
  /// Reads the composited frame with the requested layers. Samples outside `changed` are taken from
  /// the last frame.
  image::Image readFrame(const scene::PathFrame& frame,
                         const std::optional<raster::Region>& changed,
                         std::vector<methods::SampleLayer> sampleLayers);

  /// Layer `motion`, from the G-buffer; 0 in the path's first frame.
  std::vector<Vec3> motionOf(const scene::PathFrame& frame, std::span<const float> depth,
                             std::span<const std::uint32_t> object) const;
  /// Warns once, at the first frame that is entirely black.
  void warnOfBlack(const image::Image& image, int frame);
  void warnOfInside(const scene::PathFrame& frame);

  Stage& stage_;
  methods::Method& method_;
  methods::MethodPlan needs_;
  frame::StepTimer timer_;
  std::unique_ptr<trace::TraceScene> trace_;
  std::optional<raster::GBuffer> gbuffer_;
  bool saidBlack_ = false;
  bool saidInside_ = false;
  bool lookedInside_ = false;
  gl::Texture composite_;
  std::vector<float> read_;                  ///< the composite that was read back; empty: not kept
  bool composed_ = false;                    ///< the composite shows the last frame
  std::optional<scene::Camera> lastCamera_;  ///< camera of the frame in G-buffer and composite
};

}  // namespace catoptric::run
