#include "methods/perturbation/options.h"

#include <string>

#include "methods/shared/shared_options.h"

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

}  // namespace

const config::OptionTable<Options>& optionTable() {
  static const config::OptionTable<Options> table(
      "perturbation", "Options of the method perturbation.",
      {field(in(&Options::path, &PathOptions::order), "order", kOrders,
             "how the path to a vertex follows from the nearest sampled path. nearest: unchanged; "
             "linear: by its Jacobian; quadratic: by its Hessian, too; auto: linear or quadratic "
             "as `error` allows, otherwise the path is traced"),
       field(in(&Options::path, &PathOptions::sampleSpacing), "sample_spacing", range(1, 256),
             "largest spacing of sampled paths, pixels; smaller on small reflectors (`min_paths`)")
           .trade("8,16,32"),
       field(in(&Options::path, &PathOptions::fewestPaths), "min_paths", range(1, 65536),
             "smallest number of sampled paths on a reflector, unless their spacing would be below "
             "1 pixel"),
       field(&Options::bounces, "bounces", range(1, static_cast<double>(kMaxTurns)), kBouncesHelp),
       field(
           in(&Options::path, &PathOptions::groups), "several", kSeveral,
           "how all reflections of a point are found. minima: where a sampled path's reflected ray "
           "passes nearer to it than its neighbours'; groups: one in each group of nearest sampled "
           "paths, as in the paper"),
       field(in(&Options::path, &PathOptions::candidates), "candidates", range(1, 64),
             "with `several` groups: number of nearest sampled paths that are grouped"),
       field(
           in(&Options::path, &PathOptions::groupAngleDegrees), "group_angle", range(0, 180),
           "with `several` groups: largest angle between reflected directions of a group, degrees"),
       field(in(&Options::path, &PathOptions::groupDistance), "group_distance", range(0, 1),
             "with `several` groups: largest distance between reflection points of a group, as a "
             "fraction of the reflector's diameter"),
       field(in(&Options::path, &PathOptions::errorPixels), "error", range(0.001, 100),
             "with `order` auto: largest estimated error of a vertex, pixels")
           .trade("0.05,0.1,0.3,1"),
       field(in(&Options::triangles, &TriangleOptions::errorPixels), "tessellation_error",
             range(0, 100),
             "an edge is split if its midpoint's reflection is farther than this from the midpoint "
             "of its reflected ends, pixels; 0: never")
           .trade("0.25,0.5,1,2"),
       field(&Options::tracedPerPixel, "traced_per_pixel", range(0, 1000),
             "with `order` auto: most paths traced for an object's reflection in a mirror or chain "
             "of mirrors, per pixel of the frame; at least 262144. Beyond that no edge is split "
             "(counter coarse_objects)"),
       config::mebibytes(
           &Options::memoryBytes, "memory_mib",
           "memory of the virtual objects, MiB; beyond it objects are left out (counter "
           "objects_left_out)"),
       field(&Options::traceGaps, "gaps", kGaps,
             "samples that no virtual object covers. environment: they show the environment; "
             "trace: Embree traces them (counter traced_gaps), which is slow under an open sky")});
  return table;
}

}  // namespace catoptric::methods::perturbation
