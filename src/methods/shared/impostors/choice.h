// Chooses the objects that get impostors, and each reflector's list of impostors to test.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "methods/contract/method.h"
#include "methods/shared/impostors/camera.h"
#include "methods/shared/impostors/options.h"
#include "methods/shared/impostors/rest_pose.h"
#include "methods/shared/impostors/targets.h"

namespace catoptric::methods::impostors {

/// One image of an object. Impostors with equal camera inputs share an image.
struct Impostor {
  int object = 0;  ///< index
  std::optional<Plane> plane = {};
  bool depth = false;       ///< a depth map; otherwise a quad
  bool reflective = false;  ///< the object is reflective; its image stores normals
  bool slab = false;        ///< shows only the part in `plane`
  bool self = false;        ///< shows the reflector whose rays are tested against it
  bool moves = false;       ///< the object moves in some frames
  bool deforms = false;
  bool turns = false;  ///< the direction in which a reflector sees the object changes over time
  int peeled = 0;      ///< number of nearer surfaces that a depth map leaves out
  Camera camera = {};
  /// The same camera in the rest pose, in which the depth map is drawn. Empty: in the frame's pose.
  std::optional<Camera> rest = {};
};

/// The impostors that a reflector's rays are tested against, diffuse ones first.
struct ImpostorList {
  std::vector<int> members;  ///< indices of Choice::impostors
  /// One entry per member. For the first of several depth maps of an object: the number of these
  /// maps; otherwise 0.
  std::vector<int> views;
  int diffuse = 0;
};

struct Choice {
  /// By object: whether it has impostors and is left out of the environment map.
  std::vector<bool> chosen;
  std::vector<Impostor> impostors;   ///< the impostors of all reflectors
  std::vector<ImpostorList> listOf;  ///< by object: its list; empty if it is not reflective
  /// Non-planar objects that enclose a reflector; they stay in the environment map.
  std::uint64_t enclosing = 0;
  std::uint64_t left = 0;  ///< objects beyond Options::most; they stay in the environment map
  /// By object: the sum of the predicted errors of a reflector's billboards, sr rad; only of the
  /// method billboards.
  std::vector<float> billboardErrors;
  std::uint64_t coinciding = 0;  ///< pairs of a reflector and an object with the same centroid
};

/// Whether a light may move.
bool lightsMove(const scene::Scene& scene);
/// Ids of the objects that the environment map does not show.
std::vector<int> outsideEnvironment(const Options& options, const frame::Geometry& geometry,
                                    const std::vector<Shape>& shapes,
                                    const std::vector<bool>& reflects, const Choice& choice);
/// Whether the environment map changes over time. `outside`: outsideEnvironment().
bool environmentMoves(const scene::Scene& scene, const frame::Geometry& geometry,
                      const std::vector<int>& outside);

/// The result depends on the pose only. `reflects`: by object, whether it is a reflector that the
/// method shades. `mirrors`: by object, whether it is any reflector; its impostors then store
/// normals. `rest`: of the scene, or null.
Choice choose(const Options& options, Kind kind, const scene::Scene& scene,
              const frame::Geometry& geometry, const std::vector<Shape>& shapes,
              const std::vector<bool>& reflects, const std::vector<bool>& mirrors,
              RestPose* rest = nullptr);

}  // namespace catoptric::methods::impostors
