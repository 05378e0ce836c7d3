#include "methods/perturbation/path_types.h"

#include <span>

namespace catoptric::methods::perturbation {
namespace {

/// Paths meet planes this part of their size beyond the border too (ours).
constexpr double kPlaneMargin = 0.25;

float refractionOf(const scene::Scene& scene, int object) {
  return scene.materials[scene.objects[static_cast<std::size_t>(object)].material].refraction;
}

/// How a path may go on at an object: in two ways where it is inside of it.
std::vector<Meeting> waysOn(const scene::Scene& scene, int body, int object) {
  if (body < 0) return {{object, refractionOf(scene, object) > 0.0f}};
  if (body != object) return {};
  return {{object, true}, {object, false}};
}

}  // namespace

int inside(const scene::Scene& scene, const Sequence& sequence) {
  int body = -1;
  for (const Meeting& meeting : sequence) {
    if (meeting.through && refractionOf(scene, meeting.object) > 0.0f)
      body = body < 0 ? meeting.object : -1;
  }
  return body;
}

std::string nameOf(const scene::Scene& scene, const Sequence& sequence, int o) {
  const auto name = [&](int object) {
    return "\"" + scene.objects[static_cast<std::size_t>(object)].name + "\"";
  };
  std::string text = o < 0 ? "paths by" : name(o) + " in";
  for (const Meeting& meeting : sequence)
    text += (&meeting == sequence.data() ? " " : ", ") + name(meeting.object);
  return text;
}

void PathTypes::setPlane(const frame::Geometry& geometry, int object) {
  planes_[object] = planarMirror(geometry, geometry.objects[static_cast<std::size_t>(object)]);
}

PathTypes::PlaneMirror PathTypes::planarMirror(const frame::Geometry& geometry,
                                               const frame::ObjectRange& range) {
  const glm::dvec3 n = glm::normalize(glm::dvec3(geometry.attributes[range.firstVertex].normal));
  const double offset = glm::dot(n, glm::dvec3(geometry.positions[range.firstVertex]));
  // A little more of it than there is: paths about its border serve what shows there
  implicit::Domain domain{glm::dvec3(range.bounds.min), glm::dvec3(range.bounds.max)};
  const double margin = kPlaneMargin * domain.diameter();
  domain.min -= margin;
  domain.max += margin;
  return {{{{n.x, n.y, n.z}}, offset}, implicit::planeSurface(n, offset, domain)};
}

void PathTypes::find(const scene::Scene& scene, const frame::Geometry& geometry, const View& view,
                     SlowFrameLog& frameLog) {
  std::map<Sequence, PathType> found;
  std::size_t occurring = 0;
  leftOut_ = 0;
  std::vector<Sequence> shorter{{}};
  for (std::size_t length = 1; length <= options_.bounces; ++length) {
    std::vector<Sequence> longer;
    for (const Sequence& start : shorter) {
      const int body = inside(scene, start);
      for (int r = 0; r < static_cast<int>(kinds_.size()); ++r) {
        const Kind kind = kinds_[static_cast<std::size_t>(r)];
        if (kind != Kind::Planar && kind != Kind::Implicit) continue;
        if (length == 1 && !first_.contains(r)) continue;
        if (vanished(geometry, r)) continue;
        for (const Meeting& meeting : waysOn(scene, body, r)) {
          Sequence sequence = start;
          sequence.push_back(meeting);
          if (occurring == options_.maxPathTypes) {
            ++leftOut_;
            continue;
          }
          // Nodes keep their place: longer types refer to shorter ones
          auto type = types_.extract(sequence);
          if (type.empty()) {
            frameLog.begin(nameOf(scene, sequence, -1));
            const Reflector* before = length > 1 ? &*found.at(start).paths : nullptr;
            found.emplace(sequence, makeType(scene, geometry, sequence, before, view));
          } else {
            found.insert(std::move(type));
          }
          if (!found.at(sequence).occurs()) continue;
          ++occurring;
          longer.push_back(std::move(sequence));
        }
      }
    }
    shorter = std::move(longer);
  }
  types_ = std::move(found);
}

PathType PathTypes::makeType(const scene::Scene& scene, const frame::Geometry& geometry,
                             const Sequence& sequence, const Reflector* before,
                             const View& view) const {
  PathType type;
  std::vector<Turn> turns;
  double index = 1.0;
  bool isInside = false;
  for (const Meeting& meeting : sequence) {
    const frame::ObjectRange& range = geometry.objects[static_cast<std::size_t>(meeting.object)];
    Turn turn;
    turn.bounds = range.bounds;
    turn.points = {geometry.positions.data() + range.firstVertex, range.vertexCount};
    turn.through = meeting.through;
    turn.indexBefore = index;
    turn.inside = isInside;
    if (meeting.through) {
      isInside = !isInside;
      index = isInside ? static_cast<double>(refractionOf(scene, meeting.object)) : 1.0;
    }
    turn.indexAfter = index;
    const auto plane = planes_.find(meeting.object);
    if (plane == planes_.end()) {
      turn.surface = &geometry.surfaces[static_cast<std::size_t>(range.surface)].surface;
    } else {
      turn.surface = &plane->second.surface;
      type.planes.push_back(plane->second.plane);
    }
    turns.push_back(turn);
  }
  if (type.planes.size() < sequence.size()) type.planes.clear();
  if (type.planes.empty() || options_.bounces > 1)
    type.paths.emplace(turns, before, geometry.bounds, view, options_.path);
  return type;
}

std::vector<Vec4> PathTypes::number(const scene::Scene& scene) {
  std::uint32_t number = static_cast<std::uint32_t>(kinds_.size());
  std::vector<Vec4> tints(number + 1 + types_.size(), Vec4(1.0f));
  deepest_ = 0;
  for (auto& [sequence, type] : types_) {
    if (!type.occurs()) continue;
    deepest_ = std::max(deepest_, sequence.size());
    type.number =
        sequence.size() == 1 ? static_cast<std::uint32_t>(sequence[0].object) + 1 : ++number;
    const scene::Object& last = scene.objects[static_cast<std::size_t>(sequence.back().object)];
    tints[type.number] = Vec4(scene.materials[last.material].reflectionTint, 1.0f);
  }
  return tints;
}

void PathTypes::linkObjects(const scene::Scene& scene) {
  for (auto& [sequence, type] : types_) {
    const int body = inside(scene, sequence);
    for (auto& [o, object] : type.objects) {
      object.reflector = type.number;
      object.next = object.nextTotal = 0;
      const float index = refractionOf(scene, o);
      object.refraction = index > 0.0f ? (body == o ? index : 1.0f / index) : 0.0f;
      for (const Meeting& meeting : waysOn(scene, body, o)) {
        Sequence longer = sequence;
        longer.push_back(meeting);
        const auto next = types_.find(longer);
        if (next == types_.end() || !next->second.occurs()) continue;
        const bool total = body == o && !meeting.through;
        (total ? object.nextTotal : object.next) = next->second.number;
      }
    }
  }
}

}  // namespace catoptric::methods::perturbation
