// The smallest method with everything that a method can have: options, state over frames, a step, a
// counter, a table and a layer. Mirrors show the environment, faded with what the same sample
// showed in the frames before. It is in the tests' program alone: this folder and one line in
// tests/CMakeLists.txt, as a method of the program is its folder and one line in registry.cpp.
#include <algorithm>
#include <memory>
#include <vector>

#include "config/options.h"
#include "methods/contract/keeps.h"
#include "methods/contract/method.h"
#include "methods/contract/restarts.h"
#include "methods/shared/reflective_samples.h"

namespace catoptric::methods {
namespace {

constexpr const char* kLayer = "history";

struct Options {
  int restartEvery = 4;
  float share = 0.5f;
};

const config::OptionTable<Options>& optionTable() {
  using config::field, config::range;
  static const config::OptionTable<Options> table(
      "fading", "Options of the example method.",
      {field(&Options::restartEvery, "restart_every", range(1, 1000),
             "frames after which it starts anew"),
       field(&Options::share, "share", range(0.01, 1), "weight of the frame at hand")});
  return table;
}

const TableInfo& historiesTable() {
  static const TableInfo table{"histories",
                               "a number of frames that samples have faded over",
                               {{"frames", ColumnType::Integer, "since the sample first reflected"},
                                {"samples", ColumnType::Integer, "reflective samples with it"},
                                {"share", ColumnType::Real, "of all reflective samples"}}};
  return table;
}

class Fading : public Method, public KeepsFrames {
 public:
  explicit Fading(const Options& options) : options_(options) {}

  MethodPlan plan(const scene::Scene&, const RunSettings&) const override {
    MethodPlan plan;
    plan.gbuffer = true;
    plan.masks = raster::kMaskEnvironment;
    plan.items = {{"pass", "fade", "the environment along mirrored rays", 0}};
    return plan;
  }

  bool restartsAt(const scene::CameraPath& path, int number) const override {
    return onRestartGrid(number, options_.restartEvery) || cutsBefore(path, number);
  }
  std::string keeps() const override { return "the last frame"; }

  void prepare(Services&, const RunSettings& settings) override { settings_ = settings; }

  void render(const FrameInput& input, Services& services, FrameOutput& output) override {
    services.timer.measure("fade", [&] {
      raster::readBack(*services.gbuffer, true, copy_);
      if (input.restarts) history_.clear();
      history_.resize(copy_.object.size());
      fade(input, *services.lighting.environment);
      if (input.kept) upload(*services.gbuffer);
    });
    output.counters["environment"] = places_.size();
    report(output);
  }

 private:
  struct History {
    Vec3 radiance{0.0f};
    std::uint32_t frames = 0;
  };

  void fade(const FrameInput& input, const frame::EnvironmentLight& environment) {
    const int width = copy_.sampleWidth();
    const Mat3 ray = scene::rayFromPixel(input.frame.camera, width, copy_.sampleHeight());
    places_.clear();
    for (std::size_t at = 0; at < copy_.object.size(); ++at) {
      History& history = history_[at];
      const bool fills = copy_.object[at] != 0 && copy_.diffuse[4 * at + 3] > 0.0f &&
                         settings_.reflectors.contains(static_cast<int>(copy_.object[at]) - 1);
      if (!fills) {
        history = {};
        continue;
      }
      const auto x = static_cast<float>(at % static_cast<std::size_t>(width)) + 0.5f;
      const auto y = static_cast<float>(at / static_cast<std::size_t>(width)) + 0.5f;
      const Vec3 normal(copy_.normal[4 * at], copy_.normal[4 * at + 1], copy_.normal[4 * at + 2]);
      const Vec3 direction = glm::reflect(glm::normalize(ray * Vec3(x, y, 1.0f)), normal);
      const Vec3 now = environment.radiance(normalizedOr(direction, normal));
      history.radiance =
          history.frames == 0 ? now : history.radiance + options_.share * (now - history.radiance);
      ++history.frames;
      places_.push_back(static_cast<std::uint32_t>(at));
    }
  }

  void upload(raster::GBuffer& gbuffer) {
    radiance_.clear();
    for (const std::uint32_t at : places_) radiance_.push_back(history_[at].radiance);
    const std::vector<std::uint8_t> flags(settings_.masks ? places_.size() : 0, 1);
    upload_.scatter(gbuffer, !settings_.reflectors.all(), places_, radiance_, flags);
    upload_.upload(gbuffer);
  }

  void report(FrameOutput& output) const {
    std::vector<std::uint64_t> samples;
    for (const std::uint32_t at : places_) {
      samples.resize(std::max<std::size_t>(samples.size(), history_[at].frames));
      ++samples[history_[at].frames - 1];
    }
    Table& table = output.tables.emplace_back(historiesTable());
    for (std::size_t i = 0; i < samples.size(); ++i)
      if (samples[i] > 0)
        table.add(i + 1, samples[i],
                  static_cast<double>(samples[i]) / static_cast<double>(places_.size()));
    if (std::find(settings_.layers.begin(), settings_.layers.end(), kLayer) ==
        settings_.layers.end())
      return;
    SampleLayer& layer = output.sampleLayers.emplace_back(SampleLayer{kLayer, {}});
    for (const History& history : history_) layer.numbers.push_back(history.frames);
  }

  Options options_;
  RunSettings settings_;
  raster::GBufferCopy copy_;
  std::vector<History> history_;  ///< by sample
  std::vector<std::uint32_t> places_;
  std::vector<Vec3> radiance_;
  ReflectionUpload upload_;
};

}  // namespace

const MethodEntry& fadingEntry();
const MethodEntry& fadingEntry() {
  static const MethodEntry entry{
      .id = "fading",
      .summary = "the tests' example: the environment, faded over frames",
      .paper = "",
      .steps = {{"fade", "frames", "the environment along mirrored rays, with earlier frames"}},
      .counters = {{"environment", "reflective samples: all see the environment"}},
      .tables = {historiesTable()},
      .sampleLayers = {{kLayer, "frames that a sample has faded over; 0: it does not reflect"}},
      .tests = {.variants = {R"({"restart_every": 2})"}},
      .options = optionTable().schema(),
      .make = [](const config::Value& options) -> std::unique_ptr<Method> {
        return std::make_unique<Fading>(optionTable().parse(options));
      }};
  return entry;
}

}  // namespace catoptric::methods
