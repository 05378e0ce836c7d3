#include "methods/perturbation/options.h"

#include <string>

namespace catoptric::methods::perturbation {
namespace {

using config::field;
using config::in;
using config::range;

constexpr auto kOrders = config::names<Order>({{"nearest", Order::Nearest},
                                               {"linear", Order::Linear},
                                               {"quadratic", Order::Quadratic},
                                               {"auto", Order::Auto}});
constexpr auto kGaps = config::names<bool>({{"environment", false}, {"trace", true}});
constexpr auto kSeveral = config::names<bool>({{"minima", false}, {"groups", true}});

/// An integer of MiB, kept in bytes.
config::Option<Options> memory() {
  return {{.name = "memory_mib",
           .type = config::FieldType::Integer,
           .help = "memory of the virtual objects, MiB; once they have it, mirrors show no more "
                   "objects: the environment is seen there (counted: objects_left_out). It bounds "
                   "the time of scenes with many mirrors, too",
           .defaultText = std::to_string(Options{}.memoryBytes >> 20),
           .minimum = 1,
           .maximum = 65536},
          [](Options& options, const config::Value& value) {
            options.memoryBytes = static_cast<std::uint64_t>(value.asInteger()) << 20;
          }};
}

}  // namespace

const config::OptionTable<Options>& optionTable() {
  static const config::OptionTable<Options> table(
      "perturbation", "Options of the method perturbation.",
      {field(in(&Options::path, &PathOptions::order), "order", kOrders,
             "how the path to a vertex is made from the nearest sampled path. nearest: taken as it "
             "is; linear: moved by its Jacobian; quadratic: by its Hessian too; auto: whichever "
             "the option error allows, or traced anew where none does"),
       field(in(&Options::path, &PathOptions::sampleSpacing), "sample_spacing", range(1, 256),
             "pixels between sampled paths, at most; min_paths brings them closer together on "
             "reflectors that are small in the frame")
           .trade("8,16,32"),
       field(in(&Options::path, &PathOptions::fewestPaths), "min_paths", range(1, 65536),
             "sampled paths that a reflector should have at least: they come closer together, "
             "down to 1 pixel, until there are as many"),
       field(&Options::bounces, "bounces", range(1, static_cast<double>(kMaxTurns)),
             "reflections along a path; after the last a surface shows its diffuse component"),
       field(in(&Options::path, &PathOptions::groups), "several", kSeveral,
             "how several reflections of one point are told apart. minima: by sampled paths that "
             "pass the point nearer than their neighbours in the image do; groups: by groups of "
             "the nearest sampled paths, as in the paper"),
       field(in(&Options::path, &PathOptions::candidates), "candidates", range(1, 64),
             "with several: groups, how many of the nearest sampled paths of a vertex are grouped"),
       field(in(&Options::path, &PathOptions::groupAngleDegrees), "group_angle", range(0, 180),
             "with several: groups, degrees between the reflected directions of one group, at "
             "most"),
       field(in(&Options::path, &PathOptions::groupDistance), "group_distance", range(0, 1),
             "with several: groups, distance between the reflection points of one group, at most, "
             "as a share of the reflector's diameter"),
       field(in(&Options::path, &PathOptions::errorPixels), "error", range(0.001, 100),
             "with order: auto, the error of a vertex that the estimate allows, pixels")
           .trade("0.05,0.1,0.3,1"),
       field(in(&Options::triangles, &TriangleOptions::errorPixels), "tessellation_error",
             range(0, 100),
             "edges of reflected objects are halved where their middle shows farther from where "
             "their ends say than this, pixels; 0: the triangles stay as they are given")
           .trade("0.25,0.5,1,2"),
       field(
           &Options::tracedPerPixel, "traced_per_pixel", range(0, 1000),
           "with order: auto, how many paths may be traced anew for one object in one sequence of "
           "reflectors, per pixel of the image and 262144 at least; then its edges are halved no "
           "more, and its reflections are coarser than tessellation_error (a warning says so; "
           "counted: coarse_objects)"),
       memory(),
       field(&Options::traceGaps, "gaps", kGaps,
             "what samples see that no virtual object covers. environment: the surroundings, as in "
             "the paper; trace: what Embree's paths find there, which closes gaps in the hollows "
             "of waves and at rims (counted: traced_gaps; mask.retraced). It traces where the sky "
             "is seen, too: cheap in closed rooms alone")});
  return table;
}

}  // namespace catoptric::methods::perturbation
