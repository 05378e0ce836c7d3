#include "methods/glossy_lod/options.h"

#include "config/options.h"
#include "methods/shared/shared_options.h"

namespace catoptric::methods::glossy_lod {
namespace {

constexpr auto kLevels = config::names<Levels>(
    {{"adaptive", Levels::Adaptive}, {"stitched", Levels::Stitched}, {"off", Levels::Off}});
constexpr auto kOrders =
    config::names<Order>({{"near_first", Order::NearFirst}, {"as_built", Order::AsBuilt}});
constexpr auto kObjects =
    config::names<Objects>({{"all", Objects::All}, {"diffuse", Objects::Diffuse}});

}  // namespace

const config::OptionTable<Options>& optionTable() {
  using config::field, config::range;
  static const config::OptionTable<Options> table(
      "glossy_lod", "Options of the method glossy_lod.",
      {field(&Options::rays, "rays", range(1, 256), kRaysHelp).trade("8,20,40"),
       field(&Options::alpha, "alpha", range(0.0, 1e6),
             "factor on a ray's solid angle when its level of detail is chosen; 0: always the "
             "finest level")
           .trade("0,3,10,30"),
       field(&Options::coarsest, "coarsest", range(0.0, 180.0),
             "wide rays hit coarse quads of geometry images instead of fine ones. Seen from the "
             "ray's origin, the box around such a quad may be about this large, in degrees; 0: no "
             "limit. Coarse quads are missed more often, mostly by rays of wide lobes")
           .trade("0,4,8"),
       field(&Options::levels, "levels", kLevels,
             "levels of detail. adaptive: as in the paper; stitched: a ray that misses a coarse "
             "quad, or hits its back, continues in the finer quads below it, so that no ray "
             "slips through cracks between levels; off: always the finest level"),
       field(&Options::order, "order", kOrders,
             "order of a node's children. near_first: the children nearest to the middle of all "
             "reflectors come first"),
       field(&Options::filter, "filter",
             "filter radiance over each ray's footprint, instead of taking the nearest texel"),
       field(&Options::automatic, "automatic",
             "choose `rays` and `alpha` by the paper's rule: 20 and 3 for Phong exponents above "
             "3000, otherwise 40 and 10"),
       field(&Options::size, "size", range(0, 1024),
             "resolution of the geometry images: all charts of an object together have `size` "
             "times `size` quads; 0: an object's triangles and the pixels that it can cover in "
             "reflectors decide"),
       config::mebibytes(&Options::memoryBytes, "memory_mib",
                         "memory of all images, MiB; if they need more, all are made coarser"),
       field(&Options::objects, "objects", kObjects, kObjectsHelp),
       field(&Options::bounces, "bounces", range(1, 16), kBouncesHelp)});
  return table;
}

}  // namespace catoptric::methods::glossy_lod
