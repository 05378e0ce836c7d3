// The frames of one real method: G-buffer, the method's passes, composite, readback.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "methods/contract/method.h"
#include "run/sequence/sequence.h"
#include "run/stage/layers.h"
#include "run/stage/stage.h"

namespace catoptric::run {

class MethodSource : public FrameSource {
 public:
  /// `stage` must outlive this; several sources may use it one after the other.
  MethodSource(Stage& stage, methods::Method& method, const methods::MethodPlan& needs);
  ~MethodSource() override;

  std::vector<frame::StepSample> prepare() override;
  RenderedFrame render(const FrameRequest& request) override;
  std::map<std::string, std::string> context() const override;

 private:
  methods::PreviousFrame previousOf(int number) const;
  /// Moves the scene to the frame's time; says what that changes.
  void moveTo(methods::FrameInput& input);
  /// The composed frame with the asked-for layers; samples outside `changed` are those of the last
  /// frame.
  image::Image readFrame(const scene::Camera& camera, const std::optional<raster::Region>& changed,
                         std::vector<methods::SampleLayer> sampleLayers);

  /// Warns of the first wholly black frame.
  void warnOfBlack(const image::Image& image, int frame);

  Stage& stage_;
  methods::Method& method_;
  methods::MethodPlan needs_;
  frame::StepTimer timer_;
  std::unique_ptr<trace::TraceScene> trace_;
  std::optional<raster::GBuffer> gbuffer_;
  bool saidBlack_ = false;
  gl::Texture composite_;
  std::vector<float> read_;                  ///< the composite as it was read; empty: not kept
  bool composed_ = false;                    ///< the composite is that of the last frame
  std::optional<scene::Camera> lastCamera_;  ///< of the frame in G-buffer and composite
};

}  // namespace catoptric::run
