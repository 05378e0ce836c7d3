#include "methods/second_order/cameras/cluster_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "core/parallel.h"
#include "scene/reflectance.h"
#include "trace/lobes/reflect.h"

namespace catoptric::methods {
namespace {

/// Rays closer than this to the image plane (cosine to its axis) say nothing about where the eye
/// should be. Ours.
constexpr float kGrazingCosine = 0.05f;
/// The eye stays within this many scene diameters behind the image plane. Ours.
constexpr float kFarthestEye = 10.0f;
/// The nearest sample lies at least this share of the cluster's diagonal before the eye. Ours.
constexpr float kNearestShare = 0.1f;
/// Half the frame's largest width on the plane 1 m before the eye: 80 degrees. Ours.
constexpr float kWidestTangent = 5.6f;
constexpr float kWidestLobe = 1.0f;  ///< radians; lobes reach the frame's border beyond. Ours.
/// The frame's least width on that plane: 4 texels that single precision still tells apart. Ours.
constexpr float kNarrowestTangent = 1e-5f;
/// Texels around the frame, so that neighbouring clusters overlap and every look-up has
/// neighbours.
constexpr float kBorder = 1.5f;
/// Depth of a planar cluster's image at infinity is 1 minus this.
constexpr double kDepthRange = 0.999;
/// What lies closer to a planar cluster, as a share of its distance from the eye, is not drawn: its
/// own surface above all. Ours.
constexpr double kClipSlack = 1e-4;
/// Lobes of a pixel's samples are shifted by so many steps (methods/traced).
constexpr int kShifts = 4;
/// Planes that cut off what lies behind a curved cluster: their normals are n_c plus so much of the
/// camera's axis; the first that no reflected ray passes is taken. Ours.
constexpr std::array<float, 4> kClipTilts = {0.0f, 0.5f, 2.0f, 8.0f};
/// Share of rays that may pass it (shading normals can turn them below their own surface). Ours.
constexpr double kMostPassing = 0.005;
/// Share of samples that may lie below it, by steps of their heights' range, from about so many
/// samples of each cluster. Ours.
constexpr double kMostBelow = 0.1;
constexpr float kFlatShare = 1e-6f;  ///< of the heights: nothing to raise in less
constexpr std::size_t kHeightSteps = 64;
constexpr std::uint32_t kHeightSamples = 1024;
/// Least cosine between that plane's normal and a reflected ray. Ours.
constexpr float kClipCosine = 0.02f;
/// Texels of a glossy cluster are not finer than this share of a ray's own spread. Ours.
constexpr float kTexelOfSpread = 0.125f;

/// Axes of a curved cluster's camera, and where rays from the mirrored eye pass its image plane.
struct Frame {
  Vec3 mirroredEye{0.0f};  ///< e_0
  Vec3 right{1.0f, 0.0f, 0.0f};
  Vec3 down{0.0f, -1.0f, 0.0f};
  Vec3 axis{0.0f, 0.0f, -1.0f};                             ///< from e_0 to P_c
  float eyeToPlane = 1.0f;                                  ///< |P_c - e_0|
  float lobe = 0.0f;                                        ///< radians around each reflected ray
  std::array<float, 4> tiltLength{1.0f, 1.0f, 1.0f, 1.0f};  ///< of planeNormal + tilt axis
};

struct Rect {
  Vec2 min{std::numeric_limits<float>::infinity()};
  Vec2 max{-std::numeric_limits<float>::infinity()};
  void extend(const Vec2& p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
  void extend(const Rect& r) {
    min = glm::min(min, r.min);
    max = glm::max(max, r.max);
  }
  float diagonal() const { return min.x > max.x ? 0.0f : glm::length(max - min); }
};

/// Rectangles of what passes each lane.
struct LanesRect {
  Lanes2 min{lanes(std::numeric_limits<float>::infinity()),
             lanes(std::numeric_limits<float>::infinity())};
  Lanes2 max{lanes(-std::numeric_limits<float>::infinity()),
             lanes(-std::numeric_limits<float>::infinity())};
  void extend(const Lanes2& p) {
    min = {least(p.x, min.x), least(p.y, min.y)};
    max = {most(p.x, max.x), most(p.y, max.y)};
  }
  void extend(const Lanes2& p, const LaneMask& counts) {
    min = {counts ? least(min.x, p.x) : min.x, counts ? least(min.y, p.y) : min.y};
    max = {counts ? most(max.x, p.x) : max.x, counts ? most(max.y, p.y) : max.y};
  }
  Rect all() const { return {{leastOf(min.x), leastOf(min.y)}, {mostOf(max.x), mostOf(max.y)}}; }
};

/// What equation (1) needs, over a cluster's samples.
struct Extents {
  Rect near;  ///< aabb_n on the image plane
  Rect far;   ///< of the far ends on the far plane
  glm::dvec2 nearSum{0.0}, farSum{0.0};
  double product = 0.0;  ///< sum of near . far
  std::uint32_t rays = 0;
  float sag = std::numeric_limits<float>::infinity();  ///< least offset along the axis

  void add(const Extents& e) {
    near.extend(e.near);
    far.extend(e.far);
    nearSum += e.nearSum;
    farSum += e.farSum;
    product += e.product;
    rays += e.rays;
    sag = std::min(sag, e.sag);
  }
};

/// What the frame of the finished camera needs.
struct Window {
  Rect rect;  ///< tangents
  float nearest = std::numeric_limits<float>::infinity();
  double spacing = 0.0;
  std::uint64_t pairs = 0;
  double lobeShare = 0.0;  ///< sum over samples of how wide the eye sees a lobe's far end
  std::array<float, kClipTilts.size()> lowest = allInfinite();  ///< of samples, along each normal
  std::array<std::uint32_t, kClipTilts.size()> passing{};       ///< rays that pass the plane

  std::array<float, kClipTilts.size()> highest{};  ///< likewise; above the eye, hence above 0
  float farthest = 0.0f;                           ///< of samples, along the axis

  static std::array<float, kClipTilts.size()> allInfinite() {
    std::array<float, kClipTilts.size()> values;
    values.fill(std::numeric_limits<float>::infinity());
    return values;
  }
  void add(const Window& w) {
    farthest = std::max(farthest, w.farthest);
    for (std::size_t k = 0; k < kClipTilts.size(); ++k) {
      lowest[k] = std::min(lowest[k], w.lowest[k]);
      highest[k] = std::max(highest[k], w.highest[k]);
      passing[k] += w.passing[k];
    }
    rect.extend(w.rect);
    nearest = std::min(nearest, w.nearest);
    spacing += w.spacing;
    lobeShare += w.lobeShare;
    pairs += w.pairs;
  }
};

Vec3 reflected(const Vec3& v, const Vec3& normal) {
  return v - 2.0f * glm::dot(v, normal) * normal;
}

/// Where rays from inside leave a box, in units of their directions.
Lanes boxExit(const Box3& box, const Lanes3& from, const Lanes3& direction) {
  Lanes exit = lanes(std::numeric_limits<float>::infinity());
  const auto slab = [&](const Lanes& at, const Lanes& along, float low, float high) {
    const Lanes wall = along > 0.0f ? lanes(high) : lanes(low);
    exit = along == 0.0f ? exit : least((wall - at) / along, exit);
  };
  slab(from.x, direction.x, box.min.x, box.max.x);
  slab(from.y, direction.y, box.min.y, box.max.y);
  slab(from.z, direction.z, box.min.z, box.max.z);
  return most(exit, Lanes{});
}

Lanes withinFrame(const Lanes& tangent) {
  return most(least(tangent, lanes(kWidestTangent)), lanes(-kWidestTangent));
}

/// Tangents of sums of two angles, each given by its tangent, within the frame's largest.
Lanes turned(const Lanes& tangent, const Lanes& by) {
  const Lanes below = 1.0f - tangent * by;
  const Lanes widest = by < 0.0f ? lanes(-kWidestTangent) : lanes(kWidestTangent);
  return below > 0.0f ? withinFrame((tangent + by) / below) : widest;
}

Frame frameOf(const Cluster& cluster, const scene::Camera& camera) {
  Frame frame;
  const Vec3& n = cluster.meanNormal;
  // The frame's eye is the origin
  frame.mirroredEye = 2.0f * glm::dot(n, cluster.centroid) * n;
  const Vec3 toPlane = cluster.centroid - frame.mirroredEye;
  frame.eyeToPlane = glm::length(toPlane);
  frame.axis = normalizedOr(toPlane, n);
  const Vec3 mirroredRight = -reflected(Vec3(camera.worldFromCamera[0]), n);
  const Vec3 other =
      std::abs(frame.axis.y) < 0.9f ? Vec3(0.0f, 1.0f, 0.0f) : Vec3(1.0f, 0.0f, 0.0f);
  const Vec3 across = mirroredRight - glm::dot(mirroredRight, frame.axis) * frame.axis;
  frame.right =
      normalizedOr(glm::dot(across, across) > 1e-6f ? across : glm::cross(frame.axis, other),
                   Vec3(1.0f, 0.0f, 0.0f));
  frame.down = glm::cross(frame.axis, frame.right);
  for (std::size_t i = 0; i < kClipTilts.size(); ++i) {
    frame.tiltLength[i] = glm::length(cluster.planeNormal + kClipTilts[i] * frame.axis);
  }
  return frame;
}

/// Rows of a depth that is 1 on the plane dot(normal, p) = offset and falls in front of it, so that
/// nothing behind the plane is drawn. `steepest`, the largest dot product of the normal with rays
/// that advance by 1 along the camera's axis, keeps it above 0.
Vec4 depthBeyond(const glm::dvec3& normal, double offset, double steepest, const Vec4& rowW) {
  return Vec4(glm::dvec4(rowW) - kDepthRange / steepest * glm::dvec4(normal, -offset));
}

/// Half the angle of the cone that a lobe's rays fill, radians: where the outermost of `rays`
/// samples points (trace::lobeDirection).
float lobeAngle(float glossiness, int rays) {
  if (glossiness <= scene::kMirrorGlossiness) return 0.0f;
  const float n = scene::phongExponentFromGlossiness(glossiness);
  return std::acos(std::pow(0.5f / static_cast<float>(rays * kShifts), 1.0f / (n + 1.0f)));
}

/// The half space that begins `height` beyond the eye along a normal, and a little more.
Vec4 planeAbove(const glm::dvec3& normal, double height, double distance, const Vec3& eye) {
  const double offset = glm::dot(normal, glm::dvec3(eye)) + height + kClipSlack * distance;
  return Vec4(glm::dvec4(normal, -offset));
}

/// Whether few rays pass the plane with the k-th tilt below all samples, and the eye lies behind
/// it.
bool cutsOff(const Cluster& cluster, const Window& window, std::size_t k) {
  return window.passing[k] <= kMostPassing * cluster.samples && window.lowest[k] > 0.0f;
}

/// Raises `Window::lowest` of each curved cluster's plane until kMostBelow of its samples lie
/// below: a few samples on a rounded edge would let in all that stands behind the others.
void raiseClipPlanes(const Clustering& clustering, std::span<const std::uint8_t> curved,
                     std::span<const Frame> frames, std::span<const ClusterCamera> cameras,
                     std::span<Window> windows) {
  struct Heights {
    Vec3 normal{0.0f};
    float eye = 0.0f;    ///< the eye's, from the frame's eye
    float scale = 0.0f;  ///< steps per unit; 0: not raised
    std::size_t tilt = 0;
    std::uint32_t every = 1;  ///< so many samples, one is looked at
    std::uint32_t next = 0;   ///< samples until then
    std::array<std::uint32_t, kHeightSteps> count{};
  };
  const std::vector<Cluster>& clusters = clustering.clusters();
  std::vector<Heights> heights(clusters.size());
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    Heights& of = heights[c];
    if (curved[c] == 0 || clusters[c].planar) continue;
    while (of.tilt < kClipTilts.size() && !cutsOff(clusters[c], windows[c], of.tilt)) ++of.tilt;
    if (of.tilt == kClipTilts.size()) continue;
    const float highest = windows[c].highest[of.tilt];
    const float range = highest - windows[c].lowest[of.tilt];
    if (!(range > kFlatShare * highest)) continue;
    of.normal = clusters[c].planeNormal + kClipTilts[of.tilt] * frames[c].axis;
    of.eye = glm::dot(cameras[c].eye, of.normal);
    of.scale = static_cast<float>(kHeightSteps) / range;
    of.every = std::max(1u, clusters[c].samples / kHeightSamples);
  }
  for (const SampleBlock& block : clustering.blocks()) {
    for (const SampleRun& run : block.runs) {
      const std::size_t c = block.slots[run.slot];
      Heights& of = heights[c];
      if (of.scale == 0.0f) continue;
      std::uint32_t i = of.next;
      for (; i < run.count; i += of.every) {
        const float height = glm::dot(block.position[run.first + i], of.normal) - of.eye;
        const float step = (height - windows[c].lowest[of.tilt]) * of.scale;
        ++of.count[static_cast<std::size_t>(
            std::clamp(step, 0.0f, static_cast<float>(kHeightSteps - 1)))];
      }
      of.next = i - run.count;
    }
  }
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const Heights& of = heights[c];
    if (of.scale == 0.0f) continue;
    const double all = std::accumulate(of.count.begin(), of.count.end(), 0.0);
    std::size_t step = 0;
    for (double below = of.count[0]; below <= kMostBelow * all; below += of.count[step]) ++step;
    windows[c].lowest[of.tilt] += static_cast<float>(step) / of.scale;
  }
}

/// Depth of a curved cluster's image: cut off by a plane below nearly all samples that hardly a
/// ray passes, or by a near plane before all samples where there is none.
void setDepth(const Cluster& cluster, const Frame& frame, const Window& window, const Vec2& corner,
              float texel, ClusterCamera& made) {
  for (std::size_t k = 0; k < kClipTilts.size(); ++k) {
    const glm::dvec3 normal = glm::dvec3(cluster.planeNormal) +
                              static_cast<double>(kClipTilts[k]) * glm::dvec3(frame.axis);
    if (!cutsOff(cluster, window, k)) continue;
    const double length = glm::length(normal);
    const double lowest = static_cast<double>(window.lowest[k]) / length;
    const glm::dvec3 unit = normal / length;
    double steepest = 0.0;
    for (const float x : {window.rect.min.x, window.rect.max.x}) {
      for (const float y : {window.rect.min.y, window.rect.max.y}) {
        steepest = std::max(
            steepest, glm::dot(unit, glm::dvec3(frame.axis + x * frame.right + y * frame.down)));
      }
    }
    if (!(steepest > 1e-6)) continue;
    // A planar cluster's own surface lies on the plane: beyond it. A curved one's is left out by
    // its facing.
    const double distance = glm::length(glm::dvec3(cluster.centroid));
    const double offset = glm::dot(unit, glm::dvec3(made.eye)) + lowest +
                          (cluster.planar ? kClipSlack : -kClipSlack) * distance;
    if (!(offset > glm::dot(unit, glm::dvec3(made.eye)))) continue;
    made.rowZ = depthBeyond(unit, offset, steepest, made.rowW);
    made.own =
        planeAbove(unit, static_cast<double>(window.highest[k]) / length, distance, made.eye);
    const double c = kDepthRange / steepest;
    const double alongX = c * static_cast<double>(texel) * glm::dot(unit, glm::dvec3(frame.right));
    const double alongY = c * static_cast<double>(texel) * glm::dot(unit, glm::dvec3(frame.down));
    made.horizon = Vec3(-alongX, -alongY,
                        1.0 - c * glm::dot(unit, glm::dvec3(frame.axis + corner.x * frame.right +
                                                            corner.y * frame.down)));
    return;
  }
  made.rowZ = Vec4(0.0f, 0.0f, 0.0f, std::max(0.999f * window.nearest, 1e-30f));
  made.own = planeAbove(glm::dvec3(frame.axis), static_cast<double>(window.farthest),
                        glm::length(glm::dvec3(cluster.centroid)), made.eye);
}

/// The mirrored camera on its own sample grid.
ClusterCamera planarCamera(const Cluster& cluster, const scene::Camera& camera, int sampleWidth,
                           int sampleHeight, const CameraOptions& options) {
  ClusterCamera made;
  made.mirrorGrid = true;
  made.scale = options.depthImageScale;
  const glm::dvec3 n = glm::normalize(glm::dvec3(cluster.meanNormal));
  const glm::dvec3 eye = 2.0 * glm::dot(n, glm::dvec3(cluster.centroid)) * n;
  made.eye = Vec3(eye);
  const glm::dmat3 rayFromPixel(scene::rayFromPixel(camera, sampleWidth, sampleHeight));
  glm::dmat3 mirrored;
  for (int c = 0; c < 3; ++c) {
    mirrored[c] = rayFromPixel[c] - 2.0 * glm::dot(rayFromPixel[c], n) * n;
  }
  const glm::dmat3 rows = glm::transpose(glm::inverse(mirrored));
  // A mirror turns right to left: turned back, so that triangles keep their winding
  const glm::dvec3 x =
      (static_cast<double>(cluster.right) * rows[2] - rows[0]) * static_cast<double>(made.scale);
  const glm::dvec3 y =
      (rows[1] - static_cast<double>(cluster.top) * rows[2]) * static_cast<double>(made.scale);
  made.rowX = Vec4(Vec3(x), static_cast<float>(-glm::dot(x, eye)));
  made.rowY = Vec4(Vec3(y), static_cast<float>(-glm::dot(y, eye)));
  made.rowW = Vec4(Vec3(rows[2]), static_cast<float>(-glm::dot(rows[2], eye)));
  made.mirrorRight = static_cast<float>(cluster.right);
  made.mirrorTop = static_cast<float>(cluster.top);
  const auto texels = [&](int samples) {
    return std::max(1,
                    static_cast<int>(std::ceil(static_cast<float>(samples) * made.scale - 1e-3f)));
  };
  made.width = texels(cluster.right - cluster.left);
  made.height = texels(cluster.bottom - cluster.top);
  made.texelSpreadRad = scene::pixelSpreadRad(camera, sampleHeight) / made.scale;

  double steepest = 0.0;
  for (const int px : {cluster.left, cluster.right}) {
    for (const int py : {cluster.top, cluster.bottom}) {
      steepest = std::max(steepest, glm::dot(n, mirrored * glm::dvec3(px, py, 1.0)));
    }
  }
  const double offset = glm::dot(n, glm::dvec3(cluster.centroid)) +
                        kClipSlack * glm::length(glm::dvec3(cluster.centroid));
  made.rowZ = depthBeyond(n, offset, std::max(steepest, 1e-6), made.rowW);
  return made;
}

/// What image planes show of samples: tangents of the angles to the camera's axis.
struct Tangents {
  std::vector<float> x, y;
};

/// The part of one run in its cluster's window, but for the spacing; `tangents` of its samples are
/// set.
Window windowOf(const SampleBlock& block, const SampleRun& run, const Cluster& cluster,
                const Frame& frame, const Vec3& eye, const Box3& bounds, Tangents& tangents) {
  constexpr std::size_t kTilts = kClipTilts.size();
  const float infinite = std::numeric_limits<float>::infinity();
  LanesRect rect;
  Lanes nearest = lanes(infinite);
  Lanes farthest{};
  std::array<Lanes, kTilts> lowest;
  std::array<Lanes, kTilts> highest{};
  std::array<LaneMask, kTilts> passing{};
  lowest.fill(lanes(infinite));
  Lanes lobeShare{};
  const float lobeTangent = std::tan(frame.lobe);
  for (std::size_t k = 0; k < run.count; k += kLanes) {
    const std::size_t there = run.count - k;
    const Lanes3 position = block.position.load(run.first + k, there);
    const Lanes3 direction = block.direction.load(run.first + k, there);
    const Lanes3 fromEye = minus(position, eye);
    const Lanes z = dot(fromEye, frame.axis);
    const Lanes3 ray{dot(direction, frame.right), dot(direction, frame.down),
                     dot(direction, frame.axis)};
    const Lanes2 across{dot(fromEye, frame.right), dot(fromEye, frame.down)};
    const Lanes2 tangent{across.x / z, across.y / z};
    store(tangent.x, &tangents.x[run.first + k], there);
    store(tangent.y, &tangents.y[run.first + k], there);
    rect.extend(tangent);
    nearest = least(z, nearest);
    farthest = most(z, farthest);
    const Lanes height = dot(fromEye, cluster.planeNormal);
    const Lanes rise = dot(direction, cluster.planeNormal);
    for (std::size_t i = 0; i < kTilts; ++i) {
      lowest[i] = least(lowest[i], height + kClipTilts[i] * z);
      highest[i] = most(highest[i], height + kClipTilts[i] * z);
      passing[i] -=
          (rise + kClipTilts[i] * ray.z <= kClipCosine * frame.tiltLength[i]) & valid(there);
    }

    // The far end: where the ray leaves the scene, not farther to the side than the frame may
    // reach
    Lanes t = boxExit(bounds, position, direction);
    t = ray.z < 0.0f ? least(t, -0.75f * z / ray.z) : t;
    const Lanes3 end{across.x + t * ray.x, across.y + t * ray.y, z + t * ray.z};
    const Lanes2 far{end.x / end.z, end.y / end.z};
    if (frame.lobe > 0.0f) {
      // The lobe's width at the far end, seen from the eye: an eye far behind sees little of it
      const Lanes share = least(lanes(4.0f), t / most(root(dot(end, end)), lanes(1e-30f)));
      lobeShare += valid(there) ? share : Lanes{};
      const Lanes wider = share * lobeTangent;
      rect.extend({turned(far.x, -wider), turned(far.y, -wider)});
      rect.extend({turned(far.x, wider), turned(far.y, wider)});
    }
    rect.extend({withinFrame(far.x), withinFrame(far.y)});
  }
  Window w;
  w.rect = rect.all();
  w.nearest = leastOf(nearest);
  w.farthest = mostOf(farthest);
  w.lobeShare = static_cast<double>(sumOf(lobeShare));
  for (std::size_t i = 0; i < kTilts; ++i) {
    w.lowest[i] = leastOf(lowest[i]);
    w.highest[i] = mostOf(highest[i]);
    w.passing[i] =
        static_cast<std::uint32_t>(passing[i][0] + passing[i][1] + passing[i][2] + passing[i][3]);
  }
  return w;
}

/// Sum of the distances of `count` pairs of neighbours, from samples i and j on.
double spacing(const Tangents& tangents, std::size_t i, std::size_t j, std::size_t count) {
  Lanes sum{};
  for (std::size_t k = 0; k < count; k += kLanes) {
    const auto across = [&](const std::vector<float>& values) {
      return load(&values[i + k], count - k) - load(&values[j + k], count - k);
    };
    const Lanes x = across(tangents.x);
    const Lanes y = across(tangents.y);
    sum += valid(count - k) ? root(x * x + y * y) : Lanes{};
  }
  return static_cast<double>(sumOf(sum));
}

}  // namespace

float eyeDistance(float near, float far, float depth) {
  if (far == near) return std::numeric_limits<float>::infinity();
  return near * depth / (far - near);
}

Mat4 ClusterCamera::clipFromWorld(const Vec3& frameEye) const {
  // In double: the rows are steep, and the eye may be far from the origin
  const auto absolute = [&](const Vec4& row) {
    return glm::dvec4(
        glm::dvec3(Vec3(row)),
        static_cast<double>(row.w) - glm::dot(glm::dvec3(Vec3(row)), glm::dvec3(frameEye)));
  };
  const glm::dvec4 x = absolute(rowX);
  const glm::dvec4 y = absolute(rowY);
  const glm::dvec4 w = absolute(rowW);
  const glm::dvec4 z = absolute(rowZ);
  const glm::dmat4 rows(2.0 / width * x - w, w - 2.0 / height * y, z, w);
  return Mat4(glm::transpose(rows));
}

std::vector<ClusterCamera> makeClusterCameras(const Clustering& clustering,
                                              const scene::Camera& camera, int sampleWidth,
                                              int sampleHeight, const CameraOptions& options) {
  const std::vector<Cluster>& clusters = clustering.clusters();
  const std::size_t count = clusters.size();
  const std::span<const SampleBlock> blocks = clustering.blocks();
  const float depth = std::max(options.sceneBounds.diameter(), 1e-30f);  // D

  std::vector<ClusterCamera> cameras(count);
  std::vector<Frame> frames(count);
  std::vector<std::uint8_t> curved(count, 0);
  for (std::size_t c = 0; c < count; ++c) {
    if (clusters[c].planar && clusters[c].maxGlossiness <= scene::kMirrorGlossiness) {
      cameras[c] = planarCamera(clusters[c], camera, sampleWidth, sampleHeight, options);
    } else {
      frames[c] = frameOf(clusters[c], camera);
      frames[c].lobe = std::min(lobeAngle(clusters[c].maxGlossiness, options.rays), kWidestLobe);
      curved[c] = 1;
    }
  }

  // Near and far ends seen from e_0
  std::vector<std::vector<Extents>> extents(blocks.size());
  parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const SampleBlock& block = blocks[b];
      extents[b].resize(block.slots.size());
      for (const SampleRun& run : block.runs) {
        const std::size_t c = block.slots[run.slot];
        if (curved[c] == 0) continue;
        const Frame frame = frames[c];
        const Vec3 centroid = clusters[c].centroid;
        LanesRect near;
        LanesRect far;
        Lanes2 nearSum{}, farSum{};
        Lanes product{};
        Lanes sag = lanes(std::numeric_limits<float>::infinity());
        LaneMask rays{};
        for (std::size_t k = 0; k < run.count; k += kLanes) {
          const std::size_t there = run.count - k;
          const Lanes3 direction = block.direction.load(run.first + k, there);
          const Lanes3 fromCentre = minus(block.position.load(run.first + k, there), centroid);
          const Lanes along = dot(fromCentre, frame.axis);
          sag = least(sag, along);
          const Lanes z = along + frame.eyeToPlane;
          const Lanes cosine = dot(direction, frame.axis);
          const LaneMask counts = (z > 0.0f) & (cosine >= kGrazingCosine) & valid(there);
          // e_0 lies on the axis through P_c
          const Lanes2 across{dot(fromCentre, frame.right), dot(fromCentre, frame.down)};
          const Lanes shrink = frame.eyeToPlane / z;
          const Lanes2 atNear{across.x * shrink, across.y * shrink};
          const Lanes reach = (depth - along) / cosine;
          const Lanes2 atFar{across.x + reach * dot(direction, frame.right),
                             across.y + reach * dot(direction, frame.down)};
          near.extend(atNear, counts);
          far.extend(atFar, counts);
          const Lanes none{};
          nearSum.x += counts ? atNear.x : none;
          nearSum.y += counts ? atNear.y : none;
          farSum.x += counts ? atFar.x : none;
          farSum.y += counts ? atFar.y : none;
          product += counts ? atNear.x * atFar.x + atNear.y * atFar.y : none;
          rays -= counts;
        }
        Extents e;
        e.near = near.all();
        e.far = far.all();
        e.nearSum = {sumOf(nearSum.x), sumOf(nearSum.y)};
        e.farSum = {sumOf(farSum.x), sumOf(farSum.y)};
        e.product = static_cast<double>(sumOf(product));
        e.rays = static_cast<std::uint32_t>(rays[0] + rays[1] + rays[2] + rays[3]);
        e.sag = leastOf(sag);
        extents[b][run.slot].add(e);
      }
    }
  });
  std::vector<Extents> extentsOf(count);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::size_t s = 0; s < extents[b].size(); ++s) {
      extentsOf[blocks[b].slots[s]].add(extents[b][s]);
    }
  }

  // The eye by equation (1), signed by whether the rays have crossed at the far plane
  for (std::size_t c = 0; c < count; ++c) {
    if (curved[c] == 0) continue;
    const Extents& all = extentsOf[c];
    ClusterCamera& made = cameras[c];
    const Frame& frame = frames[c];
    const float near = all.near.diagonal();
    float distance = frame.eyeToPlane;
    if (all.rays > 1 && near > 0.0f) {
      const double crossed =
          all.product - glm::dot(all.nearSum, all.farSum) / static_cast<double>(all.rays);
      const float far = crossed < 0.0 ? -all.far.diagonal() : all.far.diagonal();
      distance = eyeDistance(near, far, depth);
      made.crossing = far < 0.0f;
      made.parallel = !(distance > 0.0f) || distance > kFarthestEye * depth;
      if (made.parallel) distance = kFarthestEye * depth;
    }
    const float least = kNearestShare * near - all.sag;
    if (distance < least) {
      distance = least;
      made.pushedBack = true;
    }
    made.displacement = distance / frame.eyeToPlane;
    made.eye = clusters[c].centroid - distance * frame.axis;
  }

  // The frame around near and far ends, and the samples' spacing in it
  std::vector<std::vector<Window>> windows(blocks.size());
  parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    Tangents tangents;
    for (std::size_t b = begin; b < end; ++b) {
      const SampleBlock& block = blocks[b];
      windows[b].resize(block.slots.size());
      tangents.x.resize(block.position.x.size());
      tangents.y.resize(block.position.x.size());
      for (const SampleRun& run : block.runs) {
        const std::size_t c = block.slots[run.slot];
        if (curved[c] == 0) continue;
        windows[b][run.slot].add(windowOf(block, run, clusters[c], frames[c], cameras[c].eye,
                                          options.sceneBounds, tangents));
      }

      // Pairs of neighbours in a row, and in a column
      for (std::size_t row = 0; row + 1 < block.rows.size(); ++row) {
        std::size_t above = row > 0 ? block.rows[row - 1] : block.rows[row];
        for (std::size_t r = block.rows[row]; r < block.rows[row + 1]; ++r) {
          const SampleRun& run = block.runs[r];
          if (curved[block.slots[run.slot]] == 0) continue;
          Window& w = windows[b][run.slot];
          const int last = run.x + run.count;
          w.spacing += spacing(tangents, run.first, run.first + 1, run.count - 1u);
          w.pairs += run.count - 1u;
          while (above < block.rows[row] &&
                 block.runs[above].x + block.runs[above].count <= run.x) {
            ++above;
          }
          for (std::size_t q = above; q < block.rows[row] && block.runs[q].x < last; ++q) {
            const SampleRun& other = block.runs[q];
            if (other.slot != run.slot) continue;
            const int from = std::max(run.x, other.x);
            const int to = std::min(last, other.x + other.count);
            w.spacing += spacing(tangents, run.first + static_cast<std::uint32_t>(from - run.x),
                                 other.first + static_cast<std::uint32_t>(from - other.x),
                                 static_cast<std::size_t>(to - from));
            w.pairs += static_cast<std::uint64_t>(to - from);
          }
        }
      }
    }
  });
  std::vector<Window> windowOfCluster(count);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::size_t s = 0; s < windows[b].size(); ++s) {
      windowOfCluster[blocks[b].slots[s]].add(windows[b][s]);
    }
  }

  raiseClipPlanes(clustering, curved, frames, cameras, windowOfCluster);
  for (std::size_t c = 0; c < count; ++c) {
    if (curved[c] == 0) continue;
    const Window& all = windowOfCluster[c];
    ClusterCamera& made = cameras[c];
    const Frame& frame = frames[c];
    const Vec2 size = glm::max(all.rect.max - all.rect.min, Vec2(kNarrowestTangent));
    float texel =
        all.pairs > 0 ? static_cast<float>(all.spacing / static_cast<double>(all.pairs)) : 0.0f;
    if (!(texel > 0.0f))
      texel = glm::length(size) / std::sqrt(static_cast<float>(clusters[c].samples));
    const auto share = static_cast<float>(all.lobeShare / clusters[c].samples);
    texel = std::max(
        texel, kTexelOfSpread * share * trace::lobeSpread(clusters[c].maxGlossiness, options.rays));
    texel /= options.depthImageScale;
    const float most = options.maxTexelsPerSample *
                       std::max(16.0f, static_cast<float>(clusters[c].samples)) *
                       options.depthImageScale * options.depthImageScale;
    const float asked = size.x / texel * (size.y / texel);
    made.capped = asked > most;
    if (made.capped) texel *= std::sqrt(asked / most);
    const float side = static_cast<float>(options.maxTextureSize) - 2.0f * kBorder - 1.0f;
    const float longest = std::max(size.x, size.y) / texel;
    if (longest > side) {
      made.capped = true;
      texel *= longest / side;
    }
    made.width = static_cast<int>(std::ceil(size.x / texel + 2.0f * kBorder));
    made.height = static_cast<int>(std::ceil(size.y / texel + 2.0f * kBorder));
    made.texelSpreadRad = texel;
    made.nearestMetres = all.nearest;
    made.farthestMetres = all.farthest;
    const Vec2 corner = all.rect.min - Vec2(kBorder * texel);
    const auto row = [&](const Vec3& v) { return Vec4(v, -glm::dot(v, made.eye)); };
    made.rowX = row((frame.right - corner.x * frame.axis) / texel);
    made.rowY = row((frame.down - corner.y * frame.axis) / texel);
    made.rowW = row(frame.axis);
    setDepth(clusters[c], frame, all, corner, texel, made);
  }
  return cameras;
}

}  // namespace catoptric::methods
