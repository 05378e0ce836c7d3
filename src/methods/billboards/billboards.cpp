#include "methods/billboards/billboards.h"

#include <memory>

#include "methods/shared/impostors/impostor_method.h"

namespace catoptric::methods {
namespace {

class Billboards : public impostors::ImpostorMethod {
 public:
  explicit Billboards(impostors::Options options)
      : ImpostorMethod(impostors::Kind::Billboard, std::move(options)) {}

 protected:
  std::string fragment() const override { return "methods/billboards/shaders/billboards.frag"; }
  const char* workCounter() const override { return "intersections"; }
};

}  // namespace

const MethodEntry& billboardsEntry() {
  static const MethodEntry entry = [] {
    std::vector<CounterInfo> counters = impostors::commonCounters();
    counters.push_back({"intersections", "tests of a ray against a billboard"});
    return MethodEntry{
        .id = "billboards",
        .summary =
            "intersects reflected rays with billboards (images of objects on quads), with an "
            "environment map behind them",
        .paper = "[Popescu2006] impostors",
        .steps = impostors::commonSteps(),
        .counters = std::move(counters),
        .tables = {impostors::impostorsTable(), impostors::unfitTable()},
        .tests =
            {.small =
                 R"({"face_size": 64, "texture_size": 64, "plane_size": 64, "fallback": "none"})",
             .variants = {R"({"bounces": 2, "second_diffuse": true})",
                          R"({"transition_height": 0.5})"}},
        .options = impostors::billboardOptions().schema(),
        .make = [](const config::Value& options) -> std::unique_ptr<Method> {
          return std::make_unique<Billboards>(impostors::billboardOptions().parse(options));
        }};
  }();
  return entry;
}

}  // namespace catoptric::methods
