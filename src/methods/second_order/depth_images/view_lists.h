// What views see of the scene: triangles that are culled one by one, at the level of detail that a
// view asks for.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/second_order/depth_images/diffuse_views.h"

namespace catoptric::methods::second_order {

/// How an object's triangles are drawn in a view.
enum class Sides : std::uint8_t { Both, Front, OwnFront, OwnBoth };

/// What one view sees, in the order of objects that all views share.
struct ViewList {
  struct Range {
    std::uint32_t object;  ///< index
    Sides sides;
    std::size_t first, count;  ///< of `indices`
  };
  std::vector<Range> ranges;
  std::vector<std::uint32_t> indices;
  DetailCounts detail;
};

/// Objects (indices), small ones first: what they hide of the room's shell is then not shaded.
std::vector<std::uint32_t> smallestFirst(const raster::SceneGpu& scene);

/// Culls all views, objects in this order.
std::vector<ViewList> listViews(const raster::SceneGpu& scene, std::span<const DiffuseView> views,
                                std::span<const std::uint32_t> order,
                                const frame::Geometry& geometry);

}  // namespace catoptric::methods::second_order
