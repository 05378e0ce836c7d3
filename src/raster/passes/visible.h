// Lists the triangles to draw in a view, as ordered index ranges. Triangles that are certainly
// invisible are left out.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "raster/draw.h"
#include "raster/regions/rectangle.h"
#include "raster/scene_gpu/scene_gpu.h"

namespace catoptric::raster {

/// One object's visible index ranges in the lists of a pass.
struct VisibleObject {
  int object = 0;  ///< index
  /// Mean distance of its visible meshlets from the eye, weighted by their size. The walls of a
  /// room, whose box contains the eye, thus come after the objects in front of them.
  float order = 0.0f;
  std::size_t firstRange = 0;
  std::size_t rangeCount = 0;
  std::uint64_t triangles = 0;
  bool cullBacks = false;
  std::size_t part = 0;  ///< index of the part, if several are drawn
};

/// The samples that the triangles of an object may cover.
struct CoveredSamples {
  std::vector<Rectangle> triangles;  ///< in the order of the meshlets; empty: not known
  std::vector<Rectangle> meshlets;
};

/// Index ranges of a pass, in the form that glMultiDrawElements takes.
struct DrawList {
  std::vector<VisibleObject> objects;
  std::vector<GLsizei> counts;
  std::vector<const void*> offsets;
  void clear() {
    objects.clear();
    counts.clear();
    offsets.clear();
  }
};

/// Selects which objects of the scene are drawn, and in which parts of the image.
struct Selection {
  ObjectSet objects = {};
  Which which = Which::All;
  std::span<const Rectangle> parts = {};         ///< empty: the whole image
  std::span<const CoveredSamples> covered = {};  ///< indexed by object; used with `parts` only
};

/// Whether the whole box lies beyond the near plane (z <= w).
bool beyondNear(const Mat4& clipFromWorld, const Box3& box);
bool contains(const Box3& box, const Vec3& p);

/// Lists what is visible, nearest objects first. With parts, an object is listed once for each part
/// in which it may be visible.
void listVisible(const SceneGpu& scene, const FrameView& view, const Selection& selection,
                 DrawList& list, DrawStatistics& statistics);

}  // namespace catoptric::raster
