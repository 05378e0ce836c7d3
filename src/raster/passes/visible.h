// Which triangles a view draws, as index ranges in an order: what certainly shows nothing is left
// out.
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
  /// Mean distance of its visible meshlets from the eye, by their size: a room's shell, whose box
  /// holds the eye, comes after what stands before it.
  float order = 0.0f;
  std::size_t firstRange = 0;
  std::size_t rangeCount = 0;
  std::uint64_t triangles = 0;
  bool cullBacks = false;
  std::size_t part = 0;  ///< of what is drawn in several
};

/// Samples that an object's triangles may cover.
struct CoveredSamples {
  std::vector<Rectangle> triangles;  ///< in the order of the meshlets; empty: not known
  std::vector<Rectangle> meshlets;
};

/// Index ranges of a pass, as glMultiDrawElements takes them.
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

/// What of the scene is drawn, and where.
struct Selection {
  ObjectSet objects = {};
  Which which = Which::All;
  std::span<const Rectangle> parts = {};         ///< none: everywhere
  std::span<const CoveredSamples> covered = {};  ///< by object; with parts
};

/// Whether the whole box lies beyond the near plane (z <= w).
bool beyondNear(const Mat4& clipFromWorld, const Box3& box);
bool contains(const Box3& box, const Vec3& p);

/// Lists what is seen, nearest objects first; with parts, an object once in each of them that it
/// may show in.
void listVisible(const SceneGpu& scene, const FrameView& view, const Selection& selection,
                 DrawList& list, DrawStatistics& statistics);

}  // namespace catoptric::raster
