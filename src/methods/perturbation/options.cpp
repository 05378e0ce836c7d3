#include "methods/perturbation/options.h"

#include <string>

#include "core/math.h"

namespace catoptric::methods::perturbation {

const config::Schema& schema() {
  static const config::Schema options = {
      .name = "perturbation",
      .help = "Options of the method perturbation.",
      .fields = {
          {.name = "order",
           .type = config::FieldType::String,
           .help =
               "what becomes of the nearest sampled path: taken as it is, moved by its Jacobian, "
               "by its Hessian too, or whichever the error allows, and traced anew where none "
               "does",
           .defaultText = "\"auto\"",
           .allowed = {"nearest", "linear", "quadratic", "auto"}},
          {.name = "sample_spacing",
           .type = config::FieldType::Integer,
           .help = "pixels between sampled paths, at most; reflectors that are small in the frame "
                   "get more (min_paths)",
           .defaultText = "16",
           .minimum = 1,
           .maximum = 256},
          {.name = "min_paths",
           .type = config::FieldType::Integer,
           .help = "paths closer together, down to 1 pixel, until a reflector has so many",
           .defaultText = "64",
           .minimum = 1,
           .maximum = 65536},
          {.name = "max_bounces",
           .type = config::FieldType::Integer,
           .help = "reflections along a path; after the last a surface shows its diffuse component",
           .defaultText = "1",
           .minimum = 1,
           .maximum = static_cast<double>(kMaxTurns)},
          {.name = "max_path_types",
           .type = config::FieldType::Integer,
           .help = "sequences of reflectors that are followed, shorter ones first; what reflects "
                   "beyond them shows its diffuse component (counted: path_types_left_out)",
           .defaultText = "1024",
           .minimum = 1,
           .maximum = 65536},
          {.name = "several",
           .type = config::FieldType::String,
           .help = "how several reflections of a point are told apart: by minima among "
                   "neighbouring paths, or as in the paper by groups of the nearest ones",
           .defaultText = "\"minima\"",
           .allowed = {"minima", "groups"}},
          {.name = "candidates",
           .type = config::FieldType::Integer,
           .help = "nearest sampled paths of a vertex that are put into groups",
           .defaultText = "5",
           .minimum = 1,
           .maximum = 64},
          {.name = "group_angle",
           .type = config::FieldType::Number,
           .help = "degrees between reflected directions of one group, at most",
           .defaultText = "30",
           .minimum = 0,
           .maximum = 180},
          {.name = "group_distance",
           .type = config::FieldType::Number,
           .help = "distance between reflection points of one group, at most, as a share of the "
                   "reflector's diameter",
           .defaultText = "0.1",
           .minimum = 0,
           .maximum = 1},
          {.name = "error",
           .type = config::FieldType::Number,
           .help = "order auto: error of a vertex that the estimate allows, pixels",
           .defaultText = "0.1",
           .minimum = 0.001,
           .maximum = 100},
          {.name = "tessellation_error",
           .type = config::FieldType::Number,
           .help = "edges of reflected objects are halved where their middle shows farther than "
                   "this from where its ends say, pixels; 0: the given triangles",
           .defaultText = "0.5",
           .minimum = 0,
           .maximum = 100},
          {.name = "traced_per_pixel",
           .type = config::FieldType::Number,
           .help = "order auto: edges of one object in one sequence of reflectors are halved until "
                   "so many paths have been traced anew, for each pixel of the image and 262144 at "
                   "least; then its reflections are coarser than tessellation_error (a warning; "
                   "counted: coarse_objects)",
           .defaultText = "8",
           .minimum = 0,
           .maximum = 1000},
          {.name = "unsupported",
           .type = config::FieldType::String,
           .help = "reflectors that are neither planar nor implicit surfaces, or not mirrors: an "
                   "error, or a cube map of the diffuse scene (counted)",
           .defaultText = "\"error\"",
           .allowed = {"error", "environment_map"}},
          {.name = "count_disocclusions",
           .type = config::FieldType::Bool,
           .help = "trace what no virtual object covers by Embree: counts disoccluded, where there "
                   "is a surface, mask.disoccluded; takes the time of a ray tracer",
           .defaultText = "false"},
      }};
  return options;
}

Options parseOptions(const config::Value& value) {
  config::require(value, schema());
  const auto integer = [&](const char* name) {
    return static_cast<int>(config::valueOr(value, schema(), name).asInteger());
  };
  const auto number = [&](const char* name) {
    return static_cast<float>(config::valueOr(value, schema(), name).asNumber());
  };
  const auto text = [&](const char* name) {
    return config::valueOr(value, schema(), name).asString();
  };
  Options options;
  const std::string order = text("order");
  options.path.order = order == "nearest"     ? Order::Nearest
                       : order == "linear"    ? Order::Linear
                       : order == "quadratic" ? Order::Quadratic
                                              : Order::Auto;
  options.path.sampleSpacing = integer("sample_spacing");
  options.path.fewestPaths = integer("min_paths");
  options.maxBounces = static_cast<std::size_t>(integer("max_bounces"));
  options.maxPathTypes = static_cast<std::size_t>(integer("max_path_types"));
  options.path.groups = text("several") == "groups";
  options.path.candidates = integer("candidates");
  options.path.groupAngleRad = radians(number("group_angle"));
  options.path.groupDistance = number("group_distance");
  options.path.errorPixels = number("error");
  options.triangles.errorPixels = number("tessellation_error");
  options.tracedPerPixel = number("traced_per_pixel");
  options.environmentMap = text("unsupported") == "environment_map";
  options.countDisocclusions = config::valueOr(value, schema(), "count_disocclusions").asBool();
  return options;
}

}  // namespace catoptric::methods::perturbation
