// Shades many points of surfaces together, by the formula in shading.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/lanes.h"
#include "core/math.h"
#include "frame/geometry.h"
#include "frame/shading.h"

namespace catoptric::frame {

/// Points of any objects, in any order, stored by component. Neighbours are shaded faster if they
/// lie close to each other.
struct SurfaceLanes {
  static constexpr std::size_t kMost = 64;  ///< so that all that is computed stays in L1; ours

  std::size_t count = 0;
  // Input, as for shadeSurface()
  std::array<int, kMost> object{};
  std::array<std::uint32_t, kMost> primitive{};
  alignas(64) std::array<float, kMost> u{}, v{}, coneWidth{};
  Vec3Lanes<kMost> position, direction;
  std::array<Vec2, kMost> scatter{};  ///< read only if whole SurfacePoints are requested
  // Output
  Vec3Lanes<kMost> diffuse;  ///< SurfacePoint::diffuse

  bool full() const { return count == kMost; }
  void add(int ofObject, std::uint32_t ofPrimitive, float atU, float atV, const Vec3& at,
           const Vec3& along, float width) {
    object[count] = ofObject;
    primitive[count] = ofPrimitive;
    u[count] = atU;
    v[count] = atV;
    coneWidth[count] = width;
    position.set(count, at);
    direction.set(count, along);
    ++count;
  }
};

/// Shades the points. `points`: one per lane; null: only SurfaceLanes::diffuse is requested. Gives
/// the same bits as shadeSurface() for each point, at each vector level.
void shadeSurfaces(const scene::Scene& scene, const Geometry& geometry, const Lighting& lighting,
                   SurfaceLanes& lanes, SurfacePoint* points);

}  // namespace catoptric::frame
