// Path types: the sequences of reflectors that sampled paths meet one after the other [Chen2000]
// Sec. III-B.1, with their paths and with what they show of each object.
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

/// A place where a path turns.
struct Meeting {
  int object = 0;        ///< index
  bool through = false;  ///< refracts
  bool operator<(const Meeting& other) const {
    return std::pair(object, through) < std::pair(other.object, other.through);
  }
};
using Sequence = std::vector<Meeting>;  ///< from the eye on

/// What is kept of one sequence of reflectors while they and the camera stand still.
struct PathType {
  std::optional<Reflector> paths;     ///< none: a plane by itself, exactly
  std::vector<Plane<double>> planes;  ///< where all of them are
  std::uint32_t number = 0;           ///< of samples that show them
  /// By index in geometry.objects; what shows nothing has none.
  std::map<int, VirtualObject> objects;
  /// Likewise what each takes, 0 where nothing of it shows; kUnknown: it was not looked for.
  std::vector<std::uint64_t> bytes;
  static constexpr std::uint64_t kUnknown = ~std::uint64_t{0};
  bool occurs() const { return !paths || paths->pathCount() > 0; }
  void forgetObjects() {
    objects.clear();
    bytes.clear();
  }
};

/// The body inside which a path is after these turns; -1: none. Such bodies are solid: a path that
/// has entered one meets its surface next.
int inside(const scene::Scene& scene, const Sequence& sequence);
/// What is made, for messages: an object (-1: paths) in a sequence of reflectors.
std::string nameOf(const scene::Scene& scene, const Sequence& sequence, int o);

class PathTypes {
 public:
  /// Keeps a reference to `kinds`, which are by index of objects.
  PathTypes(const Options& options, const std::vector<Kind>& kinds)
      : options_(options), kinds_(kinds) {}

  auto begin() { return types_.begin(); }
  auto end() { return types_.end(); }
  auto begin() const { return types_.begin(); }
  auto end() const { return types_.end(); }
  /// Reflections of the longest that occurs.
  std::size_t deepest() const { return deepest_; }
  /// Sequences beyond Options::maxPathTypes.
  std::uint64_t leftOut() const { return leftOut_; }

  /// Forgets what a change of these objects, or of all, has made wrong.
  template <class Changed>
  void forget(bool all, const Changed& changed) {
    std::erase_if(types_, [&](const auto& type) {
      return all ||
             std::ranges::any_of(type.first, [&](const Meeting& m) { return changed(m.object); });
    });
  }
  /// Paths begin at these reflectors alone; they go on to all.
  void setFirst(const frame::ObjectSet& reflectors) { first_ = reflectors; }
  /// A planar mirror has moved, or is new.
  void setPlane(const frame::Geometry& geometry, int object);
  /// Looks for path types, longer ones only where the shorter occur. Keeps those that were found
  /// before, and no others.
  void find(const scene::Scene& scene, const frame::Geometry& geometry, const View& view,
            SlowFrameLog& frameLog);
  /// Numbers them: of one reflector its object's id, of others whatever follows. Returns the tints
  /// of their last reflectors, by number.
  std::vector<Vec4> number(const scene::Scene& scene);
  /// On whose samples virtual objects show, and what shows on those.
  void linkObjects(const scene::Scene& scene);

 private:
  struct PlaneMirror {
    Plane<double> plane;
    implicit::Surface surface;  ///< the same
  };
  static PlaneMirror planarMirror(const frame::Geometry& geometry, const frame::ObjectRange& range);
  PathType makeType(const scene::Scene& scene, const frame::Geometry& geometry,
                    const Sequence& sequence, const Reflector* before, const View& view) const;

  Options options_;
  const std::vector<Kind>& kinds_;
  frame::ObjectSet first_;
  std::map<int, PlaneMirror> planes_;   ///< by index of their object
  std::map<Sequence, PathType> types_;  ///< those that were looked for
  std::uint64_t leftOut_ = 0;
  std::size_t deepest_ = 0;
};

}  // namespace catoptric::methods::perturbation
