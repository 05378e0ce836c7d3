// Which objects get impostors, and what each reflector's rays are intersected with.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "methods/contract/method.h"
#include "methods/shared/impostors/camera.h"
#include "methods/shared/impostors/options.h"
#include "methods/shared/impostors/targets.h"

namespace catoptric::methods::impostors {

/// One image of an object. What the camera is made of makes it the same image.
struct Impostor {
  int object = 0;  ///< index
  std::optional<Plane> plane = {};
  bool depth = false;       ///< a depth map; else a quad
  bool reflective = false;  ///< with normals
  bool slab = false;        ///< shows what lies in `plane` alone
  bool self = false;        ///< of the reflector whose rays meet it
  int peeled = 0;           ///< surfaces in front of those that a depth map shows
  Camera camera = {};
};

/// What the rays of a reflector are intersected with: the diffuse objects' come first.
struct ImpostorList {
  std::vector<int> members;  ///< indices of Choice::impostors
  int diffuse = 0;
};

struct Choice {
  std::vector<bool> chosen;          ///< by object: left out of the environment map
  std::vector<Impostor> impostors;   ///< of all reflectors
  std::vector<ImpostorList> listOf;  ///< by object; empty where it does not reflect
  std::uint64_t enclosing = 0;       ///< objects about a reflector that are no planes: in the map
  std::uint64_t left = 0;            ///< objects beyond Options::most: in the map
  std::uint64_t coinciding = 0;      ///< pairs whose centroids are one
};

/// From the pose alone. `reflects`: by object, those that the method fills; `mirrors`: all that
/// reflect, whose impostors have normals.
Choice choose(const Options& options, Kind kind, const scene::Scene& scene,
              const frame::Geometry& geometry, const std::vector<Shape>& shapes,
              const std::vector<bool>& reflects, const std::vector<bool>& mirrors);

}  // namespace catoptric::methods::impostors
