// Lists the triangles of each view, culled one by one, at the level of detail that it needs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/second_order/depth_images/diffuse_views.h"

namespace catoptric::methods::second_order {

/// Which sides of an object's triangles a view draws. Own: the object is the view's own object
/// (DiffuseView::ownObject).
enum class Sides : std::uint8_t { Both, Front, OwnFront, OwnBoth };

/// The visible triangles of one view, in an order of objects that all views share.
struct ViewList {
  struct Range {
    std::uint32_t object;  ///< index
    Sides sides;
    std::size_t first, count;  ///< range in `indices`
  };
  std::vector<Range> ranges;
  std::vector<std::uint32_t> indices;
  DetailCounts detail;
};

/// Object indices, small objects first: the walls of a room behind them are then not shaded.
std::vector<std::uint32_t> smallestFirst(const raster::SceneGpu& scene);

/// Culls all views. Objects are listed in the order `order`.
std::vector<ViewList> listViews(const raster::SceneGpu& scene, std::span<const DiffuseView> views,
                                std::span<const std::uint32_t> order,
                                const frame::Geometry& geometry);

}  // namespace catoptric::methods::second_order
