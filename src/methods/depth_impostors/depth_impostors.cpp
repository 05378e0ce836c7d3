#include "methods/depth_impostors/depth_impostors.h"

#include <memory>

#include "methods/depth_impostors/search.h"
#include "methods/depth_impostors/srdm.h"
#include "methods/shared/impostors/impostor_method.h"
#include "methods/shared/impostors/shaders/constants.h"

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
            {"DOMAINS", std::to_string(options().domains)},
            {"REFINE", std::to_string(options().refine)}};
  }
  const char* workCounter() const override {
    return options().intersection == Intersection::Walk ? "walked_texels" : "segments";
  }

  std::uint64_t deviceBytes() const override { return rowBytes_; }
  std::uint64_t mapBytes() const override {
    const auto size = static_cast<std::uint64_t>(options().textureSize);
    constexpr std::uint64_t kColumns = depth_impostors::Columns::kBorder * 2;
    // As read back, and as columns along both axes
    return sizeof(float) * (size * size + 2 * size * (size + kColumns)) + rowBytes_;
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

  void imageDrawn(int layer, std::span<const float> texels) override {
    const auto at = static_cast<std::size_t>(layer);
    if (at < lines_.size()) lines_[at] = {};
    if (at < texels_.size()) texels_[at].reset();
    if (texels.empty() || (domains_.empty() && !onProcessor())) return;
    Made& made = made_.emplace_back();
    made.layer = layer;
    made.texels.assign(texels.begin(), texels.end());
  }

  void mapsReady(Services& services, FrameOutput& output, std::size_t count,
                 std::size_t maps) override {
    if (onProcessor() && (domains_.empty() || options().refine > 0)) keepTexels(count);
    if (domains_.empty()) {
      made_.clear();
      return;
    }
    const std::size_t points = rows_ * static_cast<std::size_t>(options().points);
    const std::size_t bytes = points * sizeof(depth_impostors::Point);
    if (lines_.size() != count) {
      lines_.resize(count);
      if (onDevice()) {
        rowBuffer_ = gl::Buffer("simplified lines", count * bytes);
        rowTexture_ = gl::Texture::makeBuffer("simplified lines", GL_RG32F, rowBuffer_);
        for (std::size_t layer = 0; layer < count; ++layer)
          if (!lines_[layer].empty()) rowBuffer_.write(layer * bytes, bytes, lines_[layer].data());
      }
    }
    output.counters["rows_built"] = made_.size() * rows_;
    output.counters["rows_reused"] = (maps - made_.size()) * rows_;
    depth_impostors::Simplification done;
    if (!made_.empty()) {
      services.timer.measure("srdm", [&] {
        for (const Made& made : made_) {
          std::vector<depth_impostors::Point>& lines = lines_[static_cast<std::size_t>(made.layer)];
          lines.resize(points + depth_impostors::kSpare, depth_impostors::kUnused);
          depth_impostors::buildSrdm(made.texels, options().textureSize, domains_, options().points,
                                     std::span(lines).first(points), done);
          if (onDevice())
            rowBuffer_.write(static_cast<std::size_t>(made.layer) * bytes, bytes, lines.data());
        }
      });
    }
    made_.clear();
    output.counters["spans"] = done.spans;
    output.counters["lost_spans"] = done.lostSpans;
  }

  void bindMaps(gl::Program& program) override {
    if (rowTexture_.empty()) return;
    rowTexture_.bind(impostors::shared::kRowsUnit);
    domainTexture_.bind(impostors::shared::kDomainsUnit);
    program.set("rowsOfMap", static_cast<int>(rows_));
  }

  std::uint64_t meetMap(int layer, impostors::MapRays& rays) const override {
    const auto at = static_cast<std::size_t>(layer);
    if (domains_.empty()) return depth_impostors::walkTexels(*texels_[at], rays);
    std::uint64_t work =
        depth_impostors::searchLines({domains_, options().points, lines_[at].data()},
                                     options().intersection == Intersection::SrdmTwoRows, rays);
    if (options().refine > 0)
      work += depth_impostors::refineHits(*texels_[at], options().refine, rays);
    return work;
  }

 private:
  static std::uint64_t rowBytesOf(const impostors::Options& options) {
    if (options.intersection == Intersection::Walk) return 0;
    const depth_impostors::Domain last =
        depth_impostors::makeDomains(options.domains, options.textureSize).back();
    return static_cast<std::uint64_t>(last.offset + last.count) *
           static_cast<std::uint64_t>(options.points) * sizeof(depth_impostors::Point);
  }

  struct Made {
    int layer = 0;
    std::vector<float> texels;
  };

  void keepTexels(std::size_t layers) {
    texels_.resize(layers);
    const int size = options().textureSize;
    for (const Made& made : made_)
      texels_[static_cast<std::size_t>(made.layer)] = std::make_unique<depth_impostors::MapTexels>(
          depth_impostors::MapTexels{depth_impostors::Columns(made.texels, size, true),
                                     depth_impostors::Columns(made.texels, size, false)});
  }

  const std::uint64_t rowBytes_ = rowBytesOf(options());  ///< of one map
  std::vector<depth_impostors::Domain> domains_;
  std::size_t rows_ = 0;  ///< lines of all domains
  std::vector<Made> made_;
  std::vector<std::vector<depth_impostors::Point>> lines_;           ///< by layer
  std::vector<std::unique_ptr<depth_impostors::MapTexels>> texels_;  ///< by layer; for walks
  gl::Buffer domainBuffer_;
  gl::Texture domainTexture_;
  gl::Buffer rowBuffer_;
  gl::Texture rowTexture_;
};

}  // namespace

const MethodEntry& depthImpostorsEntry() {
  static const MethodEntry entry = [] {
    std::vector<CounterInfo> counters = impostors::commonCounters();
    counters.push_back({"disoccluded",
                        "samples whose ray passes behind a depth edge in each of an object's "
                        "several depth maps, and so misses the object"});
    counters.push_back({"segments",
                        "segments of simplified rows that rays were tested against, and texels "
                        "that `refine` tested",
                        false, "intersection srdm, srdm_two_rows"});
    counters.push_back(
        {"walked_texels", "texels that rays were tested against", false, "intersection walk"});
    counters.push_back({"spans", "runs of samples along the rows of maps made in this frame", false,
                        "intersection srdm, srdm_two_rows"});
    counters.push_back({"lost_spans",
                        "of `spans`: runs that were dropped, because a row has too few `points`",
                        false, "intersection srdm, srdm_two_rows"});
    counters.push_back({"rows_built", "simplified rows of depth maps drawn in this frame", false,
                        "intersection srdm, srdm_two_rows"});
    counters.push_back({"rows_reused",
                        "simplified rows of needed depth maps that were kept from earlier frames, "
                        "also where the object has moved rigidly",
                        false, "intersection srdm, srdm_two_rows"});
    counters.push_back({"clipped",
                        "pairs of a ray and a depth map whose frustum the ray misses, without "
                        "`culled`; only where the CPU intersects rays"});
    counters.push_back({"searched", "the other pairs of a ray and a depth map, likewise"});
    counters.push_back({"projected_texels",
                        "of `searched`: texels along the clipped rays; a walk without hits would "
                        "test all",
                        false, "intersection walk"});
    std::vector<StepInfo> steps = impostors::commonSteps();
    steps.insert(steps.begin() + 2, {"srdm", "frames", "rows of new depth maps are simplified"});
    return MethodEntry{
        .id = "depth_impostors",
        .summary =
            "intersects reflected rays with depth maps of objects, with an environment map behind "
            "them",
        .paper = "[Popescu2006] impostors",
        .steps = std::move(steps),
        .counters = std::move(counters),
        .tables = {impostors::impostorsTable(), impostors::unfitTable()},
        .tests =
            {.small =
                 R"({"face_size": 64, "texture_size": 64, "plane_size": 64, "fallback": "none", "domains": 18})",
             .variants =
                 {R"({"intersection": "walk", "bounces": 2})",
                  R"({"intersection": "srdm_two_rows", "maps": 3, "layers": 2, "refine": 2})"}},
        .options = impostors::depthOptions().schema(),
        .make = [](const config::Value& options) -> std::unique_ptr<Method> {
          return std::make_unique<DepthImpostors>(impostors::depthOptions().parse(options));
        }};
  }();
  return entry;
}

}  // namespace catoptric::methods
