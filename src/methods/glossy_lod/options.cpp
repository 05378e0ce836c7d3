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
             "rays per sample on surfaces with g above 0.05, as in traced; mirrors take one")
           .trade("8,20,40"),
       field(&Options::alpha, "alpha", range(0.0, 1e6),
             "how much wider than its solid angle a ray is taken to be, where it decides how fine "
             "the geometry must be: 0 always descends to the finest triangles")
           .trade("0,3,10,30"),
       field(
           &Options::coarsest, "coarsest", range(0.0, 180.0),
           "degrees: a box that looks larger from where a ray starts is always descended, however "
           "wide the ray is, so that wide lobes lose fewer hits; 0: no limit, as in the paper")
           .trade("0,4,8"),
       field(&Options::levels, "levels", kLevels,
             "stitched: a ray that misses a coarse quad goes on into the finer ones, so that no "
             "hit is lost "
             "between two levels; off: the traversal without any levels of detail, as alpha 0"),
       field(&Options::order, "order", kOrders,
             "of a node's children, the same for all rays: near_first, those nearest to the middle "
             "of all reflectors, so that hits are found before what they hide; as_built"),
       field(&Options::filter, "filter",
             "radiance averaged over what a ray stands for; false: that of the nearest texel"),
       field(&Options::automatic, "automatic",
             "the paper's rule instead of rays and alpha: 20 rays and alpha 3 for exponents above "
             "3000, else 40 rays and alpha 10"),
       field(&Options::size, "size", range(1, 1024),
             "quads along the edge of an object's geometry image: all of its charts together have "
             "about as many as one square of this size"),
       field(&Options::objects, "objects", kObjects,
             "what reflected rays meet: all objects, or those that do not reflect"),
       field(&Options::bounces, "bounces", range(1, 16),
             "reflections along a path; after the last a surface shows its diffuse component")});
  return table;
}

}  // namespace catoptric::methods::glossy_lod
