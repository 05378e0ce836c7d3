#include "methods/glossy_lod/options.h"

#include "config/options.h"

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
      {field(&Options::rays, "rays", range(1, 256),
             "rays per sample on rough reflectors (g above 0.05); mirrors take one")
           .trade("8,20,40"),
       field(&Options::alpha, "alpha", range(0.0, 1e6),
             "factor on a ray's solid angle when its level of detail is chosen; 0: always the "
             "finest triangles")
           .trade("0,3,10,30"),
       field(&Options::coarsest, "coarsest", range(0.0, 180.0),
             "a box that looks larger than this from a ray's origin, in degrees, is always "
             "descended, so that wide lobes lose fewer hits; 0: no limit, as in the paper")
           .trade("0,4,8"),
       field(&Options::levels, "levels", kLevels,
             "adaptive: the paper's; stitched: a ray that misses a coarse quad continues in finer "
             "ones, so that no hit is lost between levels; off: the finest level, as with alpha 0"),
       field(&Options::order, "order", kOrders,
             "order of a node's children, the same for all rays; near_first: those nearest to the "
             "middle of all reflectors first"),
       field(&Options::filter, "filter",
             "filter radiance over each ray's footprint, instead of taking the nearest texel"),
       field(&Options::automatic, "automatic",
             "the paper's rule instead of `rays` and `alpha`: 20 and 3 for exponents above 3000, "
             "otherwise 40 and 10"),
       field(&Options::size, "size", range(1, 1024),
             "quads along the edge of a square with as many quads as all charts of an object "
             "together"),
       field(&Options::objects, "objects", kObjects,
             "which objects reflected rays can hit: all, or those that do not reflect"),
       field(&Options::bounces, "bounces", range(1, 16),
             "reflections along a path; the last surface shows its diffuse component")});
  return table;
}

}  // namespace catoptric::methods::glossy_lod
