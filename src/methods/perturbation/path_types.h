// Path types [Chen2000] Sec. III-B.1: the sequences of reflectors that sampled paths hit, with
// their paths and their virtual objects.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "frame/geometry.h"
#include "frame/object_set.h"
#include "methods/perturbation/kinds.h"
#include "methods/perturbation/options.h"
#include "methods/perturbation/reflector.h"
#include "methods/perturbation/slow_frame_log.h"
#include "methods/perturbation/virtual_draw.h"
#include "scene/scene.h"

namespace catoptric::methods::perturbation {

/// A vertex of a path: a reflector and whether it refracts there.
struct Meeting {
  int object = 0;        ///< index
  bool through = false;  ///< refracts instead of reflecting
  bool operator<(const Meeting& other) const {
    return std::pair(object, through) < std::pair(other.object, other.through);
  }
};
using Sequence = std::vector<Meeting>;  ///< starts at the eye

/// What is kept of a sequence of reflectors as long as they and the camera do not move.
struct PathType {
  std::optional<Reflector> paths;     ///< nullopt: a single plane, which needs no paths
  std::vector<Plane<double>> planes;  ///< only if all reflectors are planes
  std::uint32_t number = 0;  ///< value of VirtualPass::reflectors at samples with this sequence
  /// By index in geometry.objects; objects without a visible reflection are absent.
  std::map<int, VirtualObject> objects;
  /// Size of each object's virtual object in bytes. 0: no reflection of the object is visible;
  /// kUnknown: not yet searched.
  std::vector<std::uint64_t> bytes;
  static constexpr std::uint64_t kUnknown = ~std::uint64_t{0};
  bool occurs() const { return !paths || paths->pathCount() > 0; }
  void forgetObjects() {
    objects.clear();
    bytes.clear();
  }
};

/// The object inside which a path is after these vertices; -1: none. Such objects are solid: a path
/// that has entered one next hits the same object's surface.
int inside(const scene::Scene& scene, const Sequence& sequence);
/// A text for messages. It names object `o` (-1: the sampled paths) and the sequence of reflectors.
std::string nameOf(const scene::Scene& scene, const Sequence& sequence, int o);

class PathTypes {
 public:
  /// Keeps a reference to `kinds`, which is indexed by object.
  PathTypes(const Options& options, const std::vector<Kind>& kinds)
      : options_(options), kinds_(kinds) {}

  auto begin() { return types_.begin(); }
  auto end() { return types_.end(); }
  auto begin() const { return types_.begin(); }
  auto end() const { return types_.end(); }
  /// Number of reflections of the longest sequence that occurs.
  std::size_t deepest() const { return deepest_; }
  /// Number of sequences beyond Options::maxPathTypes.
  std::uint64_t leftOut() const { return leftOut_; }

  /// Forgets the data that a change of these objects, or of all, has invalidated.
  template <class Changed>
  void forget(bool all, const Changed& changed) {
    std::erase_if(types_, [&](const auto& type) {
      return all ||
             std::ranges::any_of(type.first, [&](const Meeting& m) { return changed(m.object); });
    });
  }
  /// Restricts the first reflector of paths to these; later ones may be any.
  void setFirst(const frame::ObjectSet& reflectors) { first_ = reflectors; }
  /// Updates a planar mirror that has moved or is new.
  void setPlane(const frame::Geometry& geometry, int object);
  /// Searches for path types, longer ones only where shorter ones occur. Keeps the data of path
  /// types that were known before, and forgets path types that no longer occur.
  void find(const scene::Scene& scene, const frame::Geometry& geometry, const View& view,
            SlowFrameLog& frameLog);
  /// Numbers the sequences: a sequence of one reflector gets that object's id, the others get the
  /// following numbers. Returns the tints of their last reflectors, by number.
  std::vector<Vec4> number(const scene::Scene& scene);
  /// Sets for each virtual object the samples on which it is drawn (VirtualObject::reflector), and
  /// the value that its own samples get for the next reflection (next, nextTotal).
  void linkObjects(const scene::Scene& scene);

 private:
  struct PlaneMirror {
    Plane<double> plane;
    implicit::Surface surface;  ///< the plane as an implicit surface
  };
  static PlaneMirror planarMirror(const frame::Geometry& geometry, const frame::ObjectRange& range);
  PathType makeType(const scene::Scene& scene, const frame::Geometry& geometry,
                    const Sequence& sequence, const Reflector* before, const View& view) const;

  Options options_;
  const std::vector<Kind>& kinds_;
  frame::ObjectSet first_;
  std::map<int, PlaneMirror> planes_;   ///< by object index
  std::map<Sequence, PathType> types_;  ///< all sequences that were searched
  std::uint64_t leftOut_ = 0;
  std::size_t deepest_ = 0;
};

}  // namespace catoptric::methods::perturbation
