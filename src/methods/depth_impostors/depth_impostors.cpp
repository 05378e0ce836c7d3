#include "methods/depth_impostors/depth_impostors.h"

#include <memory>

#include "methods/depth_impostors/srdm.h"
#include "methods/impostors/impostor_method.h"
#include "methods/impostors/shaders/constants.h"

namespace catoptric::methods {
namespace {

using impostors::Intersection;

class DepthImpostors : public impostors::ImpostorMethod {
 public:
  explicit DepthImpostors(impostors::Options options)
      : ImpostorMethod(impostors::Kind::DepthMap, std::move(options)) {}

 protected:
  std::string fragment() const override {
    return "methods/depth_impostors/shaders/depth_impostors.frag";
  }
  std::vector<gl::Define> defines() const override {
    return {{"WAY", std::to_string(static_cast<int>(options().intersection))},
            {"POINTS", std::to_string(options().points)},
            {"DOMAINS", std::to_string(options().domains)}};
  }
  const char* workCounter() const override {
    return options().intersection == Intersection::Walk ? "walked_texels" : "segments";
  }

  void prepareMaps() override {
    if (options().intersection == Intersection::Walk) return;
    domains_ = depth_impostors::makeDomains(options().domains, options().textureSize);
    rows_ = static_cast<std::size_t>(domains_.back().offset + domains_.back().count);
    std::vector<Vec4> table;
    for (const depth_impostors::Domain& domain : domains_)
      table.emplace_back(domain.alongX ? 1.0f : 0.0f, domain.slope,
                         static_cast<float>(domain.first), static_cast<float>(domain.offset));
    domainBuffer_ = gl::Buffer("directions of lines", std::span<const Vec4>(table));
    domainTexture_ = gl::Texture::makeBuffer("directions of lines", GL_RGBA32F, domainBuffer_);
  }

  void mapDrawn(int layer, std::span<const float> texels) override {
    if (domains_.empty()) return;
    Made& made = made_.emplace_back();
    made.layer = layer;
    made.texels.assign(texels.begin(), texels.end());
  }

  void mapsReady(Services& services, FrameOutput& output, int layers) override {
    if (domains_.empty()) return;
    const std::size_t points = rows_ * static_cast<std::size_t>(options().points);
    const std::size_t bytes = points * sizeof(depth_impostors::Point);
    if (layers > layers_) {  // all maps were drawn anew
      layers_ = layers;
      rowBuffer_ = gl::Buffer("simplified lines", static_cast<std::size_t>(layers) * bytes);
      rowTexture_ = gl::Texture::makeBuffer("simplified lines", GL_RG32F, rowBuffer_);
    }
    depth_impostors::Simplification done;
    if (!made_.empty()) {
      services.timer.measure("srdm", [&] {
        line_.resize(points);
        for (const Made& made : made_) {
          depth_impostors::buildSrdm(made.texels, options().textureSize, domains_, options().points,
                                     line_, done);
          rowBuffer_.write(static_cast<std::size_t>(made.layer) * bytes, bytes, line_.data());
        }
      });
    }
    made_.clear();
    output.counters["spans"] = done.spans;
    output.counters["lost_spans"] = done.lostSpans;
  }

  void bindMaps(gl::Program& program) override {
    if (layers_ == 0) return;
    rowTexture_.bind(impostors::shared::kRowsUnit);
    domainTexture_.bind(impostors::shared::kDomainsUnit);
    program.set("rowsOfMap", static_cast<int>(rows_));
  }

 private:
  struct Made {
    int layer = 0;
    std::vector<float> texels;
  };

  std::vector<depth_impostors::Domain> domains_;
  std::size_t rows_ = 0;  ///< lines of all domains
  int layers_ = 0;
  std::vector<Made> made_;
  std::vector<depth_impostors::Point> line_;
  gl::Buffer domainBuffer_;
  gl::Texture domainTexture_;
  gl::Buffer rowBuffer_;
  gl::Texture rowTexture_;
};

}  // namespace

const MethodEntry& depthImpostorsEntry() {
  static const MethodEntry entry = [] {
    std::vector<CounterInfo> counters = impostors::commonCounters();
    counters.push_back({"segments", "segments of simplified lines that rays were tested against",
                        false, "intersection srdm, srdm_two_rows"});
    counters.push_back(
        {"walked_texels", "texels that rays were walked over", false, "intersection walk"});
    counters.push_back({"spans", "runs of samples along the lines of maps made in this frame",
                        false, "intersection srdm, srdm_two_rows"});
    counters.push_back({"lost_spans", "of them those that had no place among a line's points",
                        false, "intersection srdm, srdm_two_rows"});
    std::vector<StepInfo> steps = impostors::commonSteps();
    steps.insert(steps.begin() + 2,
                 {"srdm", "frames", "lines of depth maps that were drawn are simplified"});
    return MethodEntry{
        .id = "depth_impostors",
        .summary = "depth maps of objects, an environment map behind them",
        .paper = "[Popescu2006] impostors",
        .steps = std::move(steps),
        .counters = std::move(counters),
        .tables = {impostors::impostorsTable()},
        .tests = {.small =
                      R"({"face_size": 64, "texture_size": 64, "plane_size": 64, "domains": 18})",
                  .variants = {R"({"intersection": "walk", "bounces": 2})",
                               R"({"intersection": "srdm_two_rows", "maps": 3})"}},
        .options = impostors::depthOptions().schema(),
        .make = [](const config::Value& options) -> std::unique_ptr<Method> {
          return std::make_unique<DepthImpostors>(impostors::depthOptions().parse(options));
        }};
  }();
  return entry;
}

}  // namespace catoptric::methods
