// The common part of billboards and depth_impostors: objects are chosen, their images are drawn
// when needed, and rays are intersected with them in one pass over the reflective samples.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "gl/query.h"
#include "gl/shader.h"
#include "methods/contract/keeps.h"
#include "methods/contract/method.h"
#include "methods/shared/cube_map.h"
#include "methods/shared/impostors/budget.h"
#include "methods/shared/impostors/images.h"
#include "methods/shared/impostors/options.h"
#include "methods/shared/impostors/processor.h"
#include "methods/shared/impostors/unfit.h"
#include "methods/shared/reflectors.h"
#include "methods/shared/traced_samples.h"
#include "raster/passes/refractive_samples.h"

namespace catoptric::methods::impostors {

/// The columns of impostors.csv.
const TableInfo& impostorsTable();
/// The columns of unfit.csv.
const TableInfo& unfitTable();
/// The steps of both methods.
std::vector<StepInfo> commonSteps();
std::vector<CounterInfo> commonCounters();

class ImpostorMethod : public Method, public KeepsFrames {
 public:
  ImpostorMethod(Kind kind, Options options) : kind_(kind), options_(std::move(options)) {}

  MethodPlan plan(const scene::Scene& scene, const RunSettings& settings) const override;
  void prepare(Services& services, const RunSettings& settings) override;
  void render(const FrameInput& input, Services& services, FrameOutput& output) override;
  std::string keeps() const override { return "images of impostors"; }

 protected:
  /// The fragment shader of the pass, and the defines with which it is compiled.
  virtual std::string fragment() const = 0;
  virtual std::vector<gl::Define> defines() const { return {}; }
  /// Called in this order: before the first frame; for each layer that was drawn, colours apart,
  /// without texels unless it is a depth map; after all were drawn, with the number of layers and
  /// that of needed depth maps; before the pass.
  virtual void prepareMaps() {}
  virtual void imageDrawn(int /*layer*/, std::span<const float> /*texels*/) {}
  virtual void mapsReady(Services& /*services*/, FrameOutput& /*output*/, std::size_t /*layers*/,
                         std::size_t /*maps*/) {}
  virtual void bindMaps(gl::Program& /*program*/) {}
  /// Intersects rays with the depth map of a layer on the CPU. Returns the amount of work.
  virtual std::uint64_t meetMap(int /*layer*/, MapRays& /*rays*/) const { return 0; }
  /// Bytes that a depth map takes in memory, and those that each image takes on the device, besides
  /// Images::bytesOf().
  virtual std::uint64_t mapBytes() const { return 0; }
  virtual std::uint64_t deviceBytes() const { return 0; }
  /// The counter of the work per sample.
  virtual const char* workCounter() const = 0;

  const Options& options() const { return options_; }
  /// Whether the CPU or (onDevice()) the GPU intersects any rays.
  bool onProcessor() const { return onProcessor_; }
  bool onDevice() const { return !mirror_.empty() || !glossy_.empty(); }

 private:
  void follow(const FrameInput& input, Services& services);
  /// A scene in the pose in which the run's decisions are made, and what is chosen there.
  struct Start {
    Choice choice;
    std::vector<Unfit> unfit;
    bool redrawn = false;  ///< environmentMoves()
    bool rests = false;    ///< there is a rest pose
  };
  Start startOf(const scene::Scene& scene, const RunSettings& settings) const;
  std::vector<int> visibleReflectors(const FrameInput& input, const Services& services) const;
  /// Bytes of an impostor's image, and of what is made of it.
  std::uint64_t bytesOf(const Impostor& impostor, Images::Kept kept) const;
  /// Bytes of the unlit images of impostors.
  std::uint64_t unlitBytes(std::span<const Impostor> impostors, const Images::Kept& kept) const;
  /// The cost of each impostor's image. `relit`: lights move.
  std::vector<Cost> costsOf(std::span<const Impostor> impostors, bool relit,
                            const Images::Kept& kept) const;
  /// The time of the path's first frame.
  static double firstSecondsOf(const RunSettings& settings) {
    return settings.path ? settings.path->frame(1).timeSeconds : 0.0;
  }
  Images::Kept keptIn(bool memory, bool device) const {
    return {options_.bounces > 1, kind_ == Kind::DepthMap, memory, device};
  }
  /// The limit on the cost of all images of a frame. `redrawn`: the environment map is drawn, too.
  Cost mostOf(const RunSettings& settings, bool redrawn, std::uint64_t rays) const;
  /// Decides which reflectors of the frame are shaded with impostors, and which with traced rays.
  void share(const FrameInput& input, Services& services);
  void shareByDemand(const FrameInput& input, Services& services, bool redrawn);
  std::vector<int> neededOf(std::span<const int> reflectors) const;
  /// Marks the impostors that rays of this list may meet.
  void addNeeded(const ImpostorList& list, const Choice& choice, std::vector<bool>& needed) const;
  void drawImages(Services& services, FrameOutput& output);
  void traceOthers(const FrameInput& input, Services& services, FrameOutput& output);
  int wayOf(const Impostor& impostor) const;
  const Images& imagesOf(const Impostor& impostor) const {
    return impostor.plane ? planes_ : images_;
  }
  /// Size of a texel at the object's centroid, in metres.
  float texelMetres(const Impostor& impostor) const;
  /// A box that contains all points at which rays can hit the impostor.
  Box3 boxOf(const Impostor& impostor) const;
  ImpostorLines linesOf(int index, const Services& services) const;
  void makeLines(const Services& services);
  void uploadTable();
  void drawEnvironment(Services& services);
  bool isGlossy(int reflector) const {
    return reflectors_.classOf[static_cast<std::size_t>(reflector) + 1] ==
           raster::SampleClass::Glossy;
  }
  bool isUnfit(int reflector) const {
    return unfit_[static_cast<std::size_t>(reflector)] != Unfit::No;
  }
  /// Whether impostors shade glossy reflectors, or mirrors, in this frame.
  bool shows(bool glossy) const;
  /// The parts of the frame that may show these.
  std::vector<raster::Rectangle> partsOf(bool glossy, const FrameInput& input,
                                         const Services& services) const;
  ProcessorCounts intersectOnProcessor(const FrameInput& input, Services& services);
  void pass(gl::Program& program, const FrameInput& input, Services& services, bool glossy);
  void count(ProcessorCounts& counts);
  void report(const Services& services, FrameOutput& output) const;

  Kind kind_;
  Options options_;
  RunSettings settings_;
  Reflectors reflectors_;
  std::vector<bool> reflects_;  ///< by object: reflectors that this method shades
  std::vector<bool> mirrors_;   ///< by object: all reflectors
  std::vector<Unfit> unfit_;    ///< by object
  raster::RefractiveSamples refractive_;
  std::vector<frame::WorldLight> lights_;
  std::vector<Shape> shapes_;
  std::optional<RestPose> rest_;  ///< if objects with depth maps move rigidly
  Choice choice_;
  Images::Kept kept_;
  Images images_;  ///< quads and depth maps
  Images planes_;  ///< images of the planes of objects
  CubeMap cubeMap_;
  HalfCube cubeInMemory_;
  std::vector<int> inView_;          ///< reflectors
  std::vector<int> visible_;         ///< those of them that impostors shade
  std::vector<bool> traced_;         ///< by object: reflectors in view that are traced instead
  std::vector<ImpostorList> shown_;  ///< Choice::listOf, or the part that the frame needs
  std::vector<Cost> costs_;          ///< by impostor
  std::vector<int> needed_;
  raster::GBufferCopy copy_;
  trace::ReflectionOptions tracing_;
  Bands bands_;
  std::vector<ImpostorLines> lines_;  ///< by impostor
  bool onProcessor_ = false;
  bool environmentOutdated_ = true;
  std::set<int> movedSince_;  ///< objects that have moved since the environment was drawn
  std::vector<int> outside_;  ///< ids of the objects that the environment map does not show
  Box3 environmentBounds_;    ///< of the scene, when the environment was drawn
  Processor processor_;
  gl::Program mirror_;
  gl::Program glossy_;
  gl::Texture known_;  ///< R32UI by sample: marks, and the work from bit kWorkShift on
  gl::Framebuffer target_;
  gl::Buffer table_;
  gl::Buffer lists_;
  gl::Texture tableTexture_;
  gl::Texture listsTexture_;
  std::vector<std::uint32_t> knownCopy_;
};

}  // namespace catoptric::methods::impostors
