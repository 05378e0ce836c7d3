#include "methods/shared/impostors/choice.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "core/parallel.h"

namespace catoptric::methods::impostors {
namespace {

/// Half the thickness of the slice that shows one plane of an object, of the scene's diameter.
constexpr float kSlab = 3e-5f;  ///< ours: three times the tolerance of a plane
/// Centroids are one where they are nearer than this share of the object's radius. Ours.
constexpr float kCoincides = 1e-3f;
/// Limit for the sum of the predicted errors of a reflector's billboards: solid angle times the
/// angle by which a billboard is off, sr rad. Ours, measured in docs/papers/impostors.md.
constexpr float kBillboardsError = 0.25f;
constexpr float kMostAngleRad = 0.25f * kPi;  ///< of a billboard in place of depth maps; ours
/// So many objects get depth maps all, which is fast enough. Ours, measured there, too.
constexpr std::size_t kFewObjects = 32;
/// Cells along the edge of the octahedral map of directions, in the object's frame: reflectors in
/// one cell share their depth maps, which survive small motions. Ours.
constexpr float kDirectionCells = 32.0f;
/// With more pairs of a reflector and an object than this, they share billboards, too. Ours.
constexpr std::size_t kManyPairs = 4096;
constexpr float kTiltRad = radians(60.0f);  ///< of an object's further depth maps; ours
/// An object has one depth map for a reflector if the reflector's points see it along this cosine
/// to the map's direction on average, or more. Ours, measured in docs/papers/impostors.md.
constexpr float kOneView = 0.7f;
/// Otherwise it has so many, without those that are nearest to less than this share of what is
/// seen.
constexpr int kMostViews = 7;
constexpr float kLeastShare = 0.03f;
constexpr std::size_t kObjectsPerTask = 16;  ///< ours
constexpr int kPoints = 64;  ///< that stand for a surface, and directions for the sphere; ours

bool encloses(const Box3& box, const Vec3& p) {
  return glm::all(glm::lessThan(box.min, p)) && glm::all(glm::greaterThan(box.max, p));
}

/// Directions that are spread evenly over the sphere.
Vec3 fibonacci(int i) {
  const float z = 1.0f - (2.0f * static_cast<float>(i) + 1.0f) / static_cast<float>(kPoints);
  const float turn = 2.3999632f * static_cast<float>(i);  // the golden angle
  const float across = std::sqrt(1.0f - z * z);
  return {across * std::cos(turn), across * std::sin(turn), z};
}

class Chooser {
 public:
  Chooser(const Options& options, Kind kind, const scene::Scene& scene,
          const frame::Geometry& geometry, const std::vector<Shape>& shapes,
          const std::vector<bool>& reflects, const std::vector<bool>& mirrors, RestPose* rest)
      : options_(options),
        kind_(kind),
        scene_(scene),
        geometry_(geometry),
        shapes_(shapes),
        reflects_(reflects),
        mirrors_(mirrors),
        rest_(rest),
        metres_(std::max(geometry.bounds.diameter(), std::numeric_limits<float>::min())) {}

  Choice run() {
    const std::size_t count = geometry_.objects.size();
    choice_.chosen.assign(count, false);
    choice_.listOf.resize(count);
    choice_.billboardErrors.assign(count, 0.0f);
    const std::vector<int> objects = wanted();
    for (const int object : objects) choice_.chosen[static_cast<std::size_t>(object)] = true;
    billboardsToo_ = options_.depthMaps == DepthMaps::Needed ||
                     (options_.depthMaps == DepthMaps::Auto && objects.size() > kFewObjects);
    const std::vector<int> reflectors = listed();
    sharesBillboards_ = reflectors.size() * objects.size() > kManyPairs;
    for (const int reflector : reflectors) list(reflector);
    return std::move(choice_);
  }

 private:
  const Shape& shape(int object) const { return shapes_[static_cast<std::size_t>(object)]; }
  const frame::ObjectRange& range(int object) const {
    return geometry_.objects[static_cast<std::size_t>(object)];
  }

  /// Reflectors that have a list.
  std::vector<int> listed() const {
    std::vector<int> reflectors;
    for (std::size_t r = 0; r < reflects_.size(); ++r)
      if (!vanished(static_cast<int>(r)) && (reflects_[r] || (options_.bounces > 1 && mirrors_[r])))
        reflectors.push_back(static_cast<int>(r));
    return reflectors;
  }

  /// A line or a point.
  bool vanished(int object) const {
    return shape(object).area <= kLeastSize * metres_ * shape(object).radius;
  }

  /// Solid angle from the reflector, times the angle by which a look-up by direction is wrong.
  /// `least`: what is certainly not more becomes 0.
  float errorOfDirection(int reflector, int object, float least) const {
    const Shape& from = shape(reflector);
    const float distance =
        std::max(glm::length(glm::max(glm::max(range(object).bounds.min - from.centroid,
                                               from.centroid - range(object).bounds.max),
                                      Vec3(0.0f))),
                 from.radius);
    if (!(distance > 0.0f)) return 0.0f;
    const float solid = std::min(2.0f * kPi, 0.5f * shape(object).area / (distance * distance));
    if (solid * 0.5f * kPi < least) return 0.0f;
    const float aside = glm::length(from.centroid - geometry_.bounds.centre()) + from.radius;
    return solid * std::atan(aside / distance);
  }

  /// The angle by which points of a billboard are off: by the object's radius, along rays that
  /// leave the reflector anywhere about its centroid.
  float angleOfBillboard(int reflector, int object) const {
    const Vec3 line = shape(reflector).centroid - shape(object).centroid;
    return std::atan2(shape(reflector).radius * shape(object).radius, glm::dot(line, line));
  }

  /// The same as errorOfDirection(), of a billboard.
  float errorOfBillboard(int reflector, int object) const {
    const Vec3 line = shape(reflector).centroid - shape(object).centroid;
    const float solid = std::min(2.0f * kPi, 0.5f * shape(object).area / glm::dot(line, line));
    return solid * angleOfBillboard(reflector, object);
  }

  /// Of an object, for the reflector for which it is largest.
  struct Score {
    float error = 0.0f;
    bool encloses = false;  ///< a reflector, and is not made of planes
  };
  std::vector<Score> scores() const {
    std::vector<int> reflectors;
    for (std::size_t r = 0; r < reflects_.size(); ++r)
      if (reflects_[r] && !vanished(static_cast<int>(r))) reflectors.push_back(static_cast<int>(r));
    std::vector<Score> scores(geometry_.objects.size());
    parallelFor(scores.size(), kObjectsPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t o = begin; o < end; ++o) {
        const int object = static_cast<int>(o);
        const bool solid = shape(object).planes.empty() && kind_ == Kind::Billboard;
        for (const int r : reflectors) {
          if (r == object) continue;
          scores[o].error = std::max(scores[o].error, errorOfDirection(r, object, scores[o].error));
          if (solid && encloses(range(object).bounds, shape(r).centroid)) scores[o].encloses = true;
        }
      }
    });
    return scores;
  }

  /// Objects that get impostors, in order.
  std::vector<int> wanted() {
    std::vector<int> objects;
    const bool automatic = std::find(options_.objects.begin(), options_.objects.end(), "auto") !=
                           options_.objects.end();
    std::vector<Score> score = scores();
    for (std::size_t o = 0; o < score.size(); ++o) {
      const int object = static_cast<int>(o);
      if (vanished(object)) continue;
      const bool named = std::find(options_.objects.begin(), options_.objects.end(),
                                   scene_.objects[o].name) != options_.objects.end();
      const bool takes = automatic && score[o].error > 0.0f && score[o].error >= options_.least;
      if (score[o].encloses) {
        choice_.enclosing += named || (automatic && score[o].error >= options_.least) ? 1 : 0;
        continue;
      }
      if (named) score[o].error = std::numeric_limits<float>::max();
      if (named || takes) objects.push_back(object);
    }
    std::stable_sort(objects.begin(), objects.end(), [&](int a, int b) {
      return score[static_cast<std::size_t>(a)].error > score[static_cast<std::size_t>(b)].error;
    });
    const auto most = static_cast<std::size_t>(options_.most);
    if (objects.size() > most) {
      choice_.left = objects.size() - most;
      objects.resize(most);
    }
    return objects;
  }

  void list(int reflector) {
    ImpostorList& into = choice_.listOf[static_cast<std::size_t>(reflector)];
    if (billboardsToo_) chooseBillboards(reflector);
    for (const bool reflective : {false, true}) {
      for (std::size_t o = 0; o < choice_.chosen.size(); ++o) {
        const int object = static_cast<int>(o);
        if (!choice_.chosen[o] || object == reflector || mirrors_[o] != reflective) continue;
        add(reflector, object, into);
      }
      if (!reflective) into.diffuse = static_cast<int>(into.members.size());
    }
    if (kind_ == Kind::DepthMap && !shape(reflector).flat()) selfMaps(reflector, into);
    into.views.resize(into.members.size(), 0);
  }

  /// Whether the object's planes are its impostors for a reflector: it is one plane, or consists of
  /// planes that surround the reflector.
  bool asPlanes(int reflector, int object) const {
    const Shape& what = shape(object);
    return what.flat() ||
           (!what.planes.empty() && encloses(range(object).bounds, shape(reflector).centroid));
  }

  /// Sets the objects that have billboards for a reflector: those with the least predicted errors,
  /// as far as the sum of the errors allows.
  void chooseBillboards(int reflector) {
    billboards_.assign(choice_.chosen.size(), false);
    std::vector<std::pair<float, int>> errors;
    for (std::size_t o = 0; o < choice_.chosen.size(); ++o) {
      const int object = static_cast<int>(o);
      if (choice_.chosen[o] && object != reflector && !asPlanes(reflector, object) &&
          angleOfBillboard(reflector, object) < kMostAngleRad)
        errors.emplace_back(errorOfBillboard(reflector, object), object);
    }
    std::ranges::sort(errors);
    float sum = 0.0f;
    for (const auto& [error, object] : errors) {
      sum += error;
      if (!(sum < kBillboardsError)) break;
      billboards_[static_cast<std::size_t>(object)] = true;
    }
  }

  void add(int reflector, int object, ImpostorList& into) {
    const std::size_t first = into.members.size();
    if (asPlanes(reflector, object)) {
      const Shape& what = shape(object);
      const Vec3 from = shape(reflector).centroid;
      for (std::size_t p = 0; p < what.planes.size(); ++p) {
        const bool behind = glm::dot(what.planes[p].normal, from) < what.planes[p].offset;
        into.members.push_back(flat(object, static_cast<int>(p), behind));
      }
      return;
    }
    if (kind_ == Kind::Billboard ||
        (billboardsToo_ && billboards_[static_cast<std::size_t>(object)])) {
      into.members.push_back(billboard(reflector, object));
      if (kind_ == Kind::Billboard)
        choice_.billboardErrors[static_cast<std::size_t>(reflector)] +=
            errorOfBillboard(reflector, object);
    } else {
      depthMaps(reflector, object, into);
    }
    if (!range(reflector).moving && !range(object).moving) return;
    for (std::size_t m = first; m < into.members.size(); ++m)
      choice_.impostors[static_cast<std::size_t>(into.members[m])].turns = true;
  }

  int insert(Impostor impostor) {
    const frame::ObjectRange& shown = range(impostor.object);
    impostor.reflective = mirrors_[static_cast<std::size_t>(impostor.object)];
    impostor.moves = shown.moving;
    impostor.deforms = shown.deforms;
    choice_.impostors.push_back(impostor);
    return static_cast<int>(choice_.impostors.size()) - 1;
  }

  /// One depth map after the other; returns the first.
  int insertLayers(Impostor impostor) {
    const int first = insert(impostor);
    while (++impostor.peeled < options_.layers) insert(impostor);
    return first;
  }

  void addLayers(int first, ImpostorList& into) const {
    for (int i = 0; i < options_.layers; ++i) into.members.push_back(first + i);
  }

  int flat(int object, int index, bool behind) {
    const auto key = std::tuple(object, index, behind);
    if (const auto found = flats_.find(key); found != flats_.end()) return found->second;
    const Plane& plane = shape(object).planes[static_cast<std::size_t>(index)];
    const Vec3 normal = behind ? -plane.normal : plane.normal;
    Impostor impostor{.object = object, .plane = plane};
    impostor.slab = !shape(object).flat();
    const std::vector<Vec3> points = impostor.slab ? verticesIn(geometry_, object, plane, metres_)
                                                   : verticesOf(geometry_, object);
    Box3 box;
    for (const Vec3& p : points) box.extend(p);
    Vec3 centre = box.centre();
    centre += plane.normal * (plane.offset - glm::dot(plane.normal, centre));
    impostor.camera = lookAtPoints(points, centre, -normal, upBeside(range(object), normal),
                                   kLeastSize * metres_);
    // Transition walls stand on the object's edges
    if (!impostor.slab && options_.transitionHeight > 0.0f)
      impostor.camera = withoutMargin(impostor.camera);
    Camera& camera = impostor.camera;
    const float half = impostor.slab ? kSlab * metres_ : 0.1f * camera.centreMetres;
    camera.nearMetres = camera.centreMetres - half;
    camera.farMetres = camera.centreMetres + half;
    const int made = insert(impostor);
    flats_.emplace(key, made);
    return made;
  }

  Vec3 directionTo(int reflector, int object) {
    const Vec3 line = shape(reflector).centroid - shape(object).centroid;
    const float length = glm::length(line);
    if (length > kCoincides * shape(object).radius && length > kLeastSize * metres_)
      return line / length;
    ++choice_.coinciding;
    return normalizedOr(Vec3(range(object).worldFromObject[2]), Vec3(0, 0, 1));
  }

  int billboard(int reflector, int object) {
    const Vec3 towards = directionTo(reflector, object);
    if (!sharesBillboards_) return insert(lookingAlong(-towards, {.object = object}));
    const View cell = cellOf(object, towards);
    const auto [at, added] = quads_.try_emplace({object, cell.number});
    if (added) at->second = insert(lookingAlong(cell.forward, {.object = object}));
    return at->second;
  }

  /// Completes an impostor of a whole object by its camera.
  Impostor lookingAlong(const Vec3& forward, Impostor impostor) const {
    const int object = impostor.object;
    impostor.camera = cameraAlong(geometry_, object, shape(object).centroid, forward);
    return impostor;
  }

  /// A direction in which a camera looks at an object.
  struct View {
    int number = 0;  ///< of the object's directions
    Vec3 inObject;   ///< in the object's frame
    Vec3 forward;    ///< in world space
  };

  /// A depth map, drawn in the rest pose if the object moves rigidly.
  int depthMap(const View& view, Impostor impostor) {
    impostor.depth = true;
    const std::optional<Mat4> motion =
        rest_ != nullptr ? rest_->motionTo(geometry_, impostor.object) : std::nullopt;
    if (!motion) return insertLayers(lookingAlong(view.forward, impostor));
    impostor.rest = rest_->camera(impostor.object, view.number, view.inObject);
    impostor.camera = moved(*impostor.rest, *motion);
    return insertLayers(impostor);
  }

  const std::vector<SurfacePoint>& pointsOf(int object) {
    std::vector<SurfacePoint>& points = points_[object];
    if (points.empty()) points = pointsOn(geometry_, object, kPoints);
    return points;
  }

  /// Directions from points of the object in which it sees the reflector, with their shares of the
  /// solid angle.
  std::vector<std::pair<Vec3, float>> sightsOf(int reflector, int object) {
    std::vector<std::pair<Vec3, float>> sights;
    const Shape& shape = this->shape(reflector);
    const Box3& bounds = range(reflector).bounds;
    const float slack = kLeastSize * metres_ + 1e-3f * shape.radius;
    const float nearest = 0.01f * this->shape(object).radius;
    for (const SurfacePoint& to : pointsOf(object)) {
      // However wide a plane is: by direction, not by its points
      for (int i = 0; shape.flat() && i < kPoints; ++i) {
        const Vec3 towards = fibonacci(i);
        const Plane& plane = shape.planes.front();
        const float t =
            (plane.offset - glm::dot(plane.normal, to.place)) / glm::dot(plane.normal, towards);
        const Vec3 place = to.place + t * towards;
        if (t > 0.0f && encloses({bounds.min - slack, bounds.max + slack}, place))
          sights.emplace_back(towards, 1.0f);
      }
      if (shape.flat()) continue;
      for (const SurfacePoint& from : pointsOf(reflector)) {
        const Vec3 line = from.place - to.place;
        const float length = std::max(glm::length(line), nearest);
        const float cosine = -glm::dot(from.normal, line) / length;
        if (cosine > 0.0f) sights.emplace_back(line / length, cosine / (length * length));
      }
    }
    float sum = 0.0f;
    for (const auto& [direction, weight] : sights) sum += weight;
    for (auto& [direction, weight] : sights) weight /= sum;
    return sights;
  }

  void depthMaps(int reflector, int object, ImpostorList& into) {
    const std::vector<Vec3> directions = viewsOf(reflector, object);
    const std::size_t begin = into.members.size();
    for (const Vec3& towards : directions) addLayers(depthMap(object, towards), into);
    if (directions.size() == 1 || options_.layers > 1) return;
    into.views.resize(begin + 1, 0);
    into.views[begin] = static_cast<int>(directions.size());
  }

  /// Where the object's depth maps look from for a reflector.
  std::vector<Vec3> viewsOf(int reflector, int object) {
    const Vec3 main = directionTo(reflector, object);
    if (options_.maps == 1 || (options_.maps == 0 && options_.layers > 1)) return {main};
    if (options_.maps > 1) return around(main, object, options_.maps);
    const auto sights = sightsOf(reflector, object);
    Vec3 mean(0.0f);
    for (const auto& [direction, weight] : sights) mean += weight * direction;
    if (sights.empty() || glm::dot(mean, main) >= kOneView) return {main};
    const std::vector<Vec3> all = around(normalizedOr(mean, main), object, kMostViews);
    std::vector<float> shares(all.size(), 0.0f);
    for (const auto& sight : sights) {
      const auto nearest = std::ranges::max_element(
          all, {}, [&](const Vec3& view) { return glm::dot(view, sight.first); });
      shares[static_cast<std::size_t>(nearest - all.begin())] += sight.second;
    }
    std::vector<Vec3> views;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (shares[i] >= kLeastShare) views.push_back(all[i]);
    return views;
  }

  /// `main`, and others 60 degrees from it, all around.
  std::vector<Vec3> around(const Vec3& main, int object, int count) const {
    const Vec3 across = glm::normalize(glm::cross(main, upBeside(range(object), main)));
    const Vec3 along = glm::cross(across, main);
    std::vector<Vec3> views{main};
    for (int i = 1; i < count; ++i) {
      const float turn = 2.0f * kPi * static_cast<float>(i - 1) / static_cast<float>(count - 1);
      views.push_back(std::cos(kTiltRad) * main +
                      std::sin(kTiltRad) * (std::cos(turn) * across + std::sin(turn) * along));
    }
    return views;
  }

  /// The view of the cell of directions that contains `towards`.
  View cellOf(int object, const Vec3& towards) const {
    const Mat3 axes = axesOf(range(object));
    Vec3 local = glm::transpose(axes) * towards;
    local /= std::abs(local.x) + std::abs(local.y) + std::abs(local.z);
    const auto signs = [](const Vec2& v) {
      return Vec2(v.x < 0.0f ? -1.0f : 1.0f, v.y < 0.0f ? -1.0f : 1.0f);
    };
    Vec2 at(local.x, local.y);
    if (local.z < 0.0f) at = (1.0f - glm::abs(Vec2(at.y, at.x))) * signs(at);
    const Vec2 cell =
        glm::clamp(glm::floor((0.5f + 0.5f * at) * kDirectionCells), 0.0f, kDirectionCells - 1.0f);
    at = 2.0f * (cell + 0.5f) / kDirectionCells - 1.0f;
    Vec3 back(at, 1.0f - std::abs(at.x) - std::abs(at.y));
    if (back.z < 0.0f) {
      const Vec2 folded = (1.0f - glm::abs(Vec2(at.y, at.x))) * signs(at);
      back = Vec3(folded, back.z);
    }
    const Vec3 forward = -glm::normalize(back);
    return {static_cast<int>(cell.y * kDirectionCells + cell.x), forward,
            glm::normalize(axes * forward)};
  }

  /// The depth map that looks from the cell of `towards`.
  int depthMap(int object, const Vec3& towards) {
    const View cell = cellOf(object, towards);
    const auto [at, added] = maps_.try_emplace({object, cell.number});
    if (added) at->second = depthMap(cell, {.object = object});
    return at->second;
  }

  /// Depth maps for the rays of the object that they show, from the ends of its axes.
  void selfMaps(int object, ImpostorList& into) {
    const std::size_t begin = into.members.size();
    const Mat3 axes = axesOf(range(object));
    for (int i = 0; i < options_.selfMaps; ++i) {
      const int axis = (i + 1) % 3;
      const float side = i < 3 ? -1.0f : 1.0f;
      View view{.number = -1 - i, .inObject = Vec3(0.0f), .forward = side * axes[axis]};
      view.inObject[axis] = side;
      addLayers(depthMap(view, {.object = object, .self = true}), into);
    }
    if (options_.selfMaps == 0 || options_.layers > 1) return;
    into.views.resize(begin + 1, 0);
    into.views[begin] = options_.selfMaps;
  }

  const Options& options_;
  Kind kind_;
  const scene::Scene& scene_;
  const frame::Geometry& geometry_;
  const std::vector<Shape>& shapes_;
  const std::vector<bool>& reflects_;
  const std::vector<bool>& mirrors_;
  RestPose* rest_;
  float metres_;
  bool billboardsToo_ = false;     ///< of a method of depth maps
  std::vector<bool> billboards_;   ///< by object: see chooseBillboards()
  bool sharesBillboards_ = false;  ///< between reflectors in one cell
  Choice choice_;
  std::map<std::tuple<int, int, bool>, int> flats_;  ///< object, plane, side
  std::map<std::pair<int, int>, int> maps_;          ///< object, cell
  std::map<std::pair<int, int>, int> quads_;         ///< object, cell
  std::map<int, std::vector<SurfacePoint>> points_;  ///< by object
};

}  // namespace

bool lightsMove(const scene::Scene& scene) {
  return scene.animated() && std::ranges::any_of(scene.lights, [](const scene::Light& light) {
           return light.node != scene::kNone;
         });
}

std::vector<int> outsideEnvironment(const Options& options, const frame::Geometry& geometry,
                                    const std::vector<Shape>& shapes,
                                    const std::vector<bool>& reflects, const Choice& choice) {
  std::vector<int> outside;
  const bool shares = options.transitionHeight > 0.0f && options.shareEnvironment;
  const Vec3 centre = geometry.bounds.centre();
  for (std::size_t o = 0; o < choice.chosen.size(); ++o) {
    // A reflector about the map's centre would hide all from it
    const Box3& box = geometry.objects[o].bounds;
    const bool hides = reflects[o] && !shapes[o].flat() &&
                       glm::all(glm::lessThanEqual(box.min, centre)) &&
                       glm::all(glm::greaterThanEqual(box.max, centre));
    if (hides || (choice.chosen[o] && !(shares && shapes[o].flat())))
      outside.push_back(static_cast<int>(o) + 1);
  }
  return outside;
}

bool environmentMoves(const scene::Scene& scene, const frame::Geometry& geometry,
                      const std::vector<int>& outside) {
  bool moves = lightsMove(scene);
  for (std::size_t o = 0; o < geometry.objects.size(); ++o)
    moves = moves || (geometry.objects[o].moving &&
                      !std::ranges::binary_search(outside, static_cast<int>(o) + 1));
  return moves;
}

Choice choose(const Options& options, Kind kind, const scene::Scene& scene,
              const frame::Geometry& geometry, const std::vector<Shape>& shapes,
              const std::vector<bool>& reflects, const std::vector<bool>& mirrors, RestPose* rest) {
  return Chooser(options, kind, scene, geometry, shapes, reflects, mirrors, rest).run();
}

}  // namespace catoptric::methods::impostors
