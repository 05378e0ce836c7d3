#include "methods/shared/impostors/tile_rays.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "methods/shared/impostors/shaders/constants.h"
#include "trace/lobes/sky.h"

namespace catoptric::methods::impostors {
namespace {

constexpr float kCovered = 0.5f;   ///< as in impostors.glsl
constexpr float kNothing = 1e30f;  ///< where a ray that meets nothing ends

}  // namespace

TileRays& TileRays::ofThread() {
  static thread_local TileRays rays;
  return rays;
}

void TileRays::begin(const ProcessorFrame& frame, ProcessorCounts& counts) {
  frame_ = &frame;
  counts_ = &counts;
  const int width = frame.gbuffer.sampleWidth();
  const int height = frame.gbuffer.sampleHeight();
  camera_ = {frame.camera.eye(), frame.camera.nearMetres,
             scene::rayFromPixel(frame.camera, width, height)};
  spread_ = scene::pixelSpreadRad(frame.camera, height);
}

void TileRays::run() {
  aim(camera_, samples_, first_);
  std::fill_n(first_.marks.begin(), first_.count, 0u);
  nearest(first_, false);
  if (frame_->options.bounces > 1) goOn();
  for (std::size_t i = 0; i < first_.count; ++i)
    if (first_.hidden[i] < first_.t[i]) first_.marks[i] |= raster::kMaskDisoccluded;
  fade(first_);
  addEnvironment(first_);
}

const HalfImage& TileRays::colorsOf(const ImpostorLines& lines) const {
  return (lines.plane ? frame_->planes : frame_->images)[static_cast<std::size_t>(lines.layer)];
}

void TileRays::nearest(RayBatch& rays, bool diffuseAlone) {
  std::fill_n(rays.t.begin(), kMostRays, kNothing);
  for (Lane* color : {&rays.color.x, &rays.color.y, &rays.color.z})
    std::fill_n(color->begin(), rays.count, 0.0f);
  std::fill_n(rays.share.begin(), rays.count, 0.0f);
  std::fill_n(rays.hidden.begin(), rays.count, kNothing);
  std::fill_n(rays.impostor.begin(), rays.count, -1);
  const ImpostorList& list = frame_->lists[static_cast<std::size_t>(rays.object - 1)];
  const std::size_t count =
      diffuseAlone ? static_cast<std::size_t>(list.diffuse) : list.members.size();
  if (frame_->countsRays) counts_->work += rays.count * count;
  if (count == 0) return;
  meetInOrder(rays, list, count);
  if (frame_->options.transitionHeight > 0.0f) shadeWalls(rays);
}

void TileRays::fade(RayBatch& rays) const {
  if (!(frame_->options.attenuation > 0.0f)) return;
  for (std::size_t i = 0; i < rays.count; ++i) {
    const float kept = std::exp(-rays.t[i] / frame_->options.attenuation);
    rays.color.set(i, kept * rays.color.at(i));
  }
}

void TileRays::meetInOrder(RayBatch& rays, const ImpostorList& list, std::size_t count) {
  const RayBounds bounds = bound(rays);
  const Vec3 middle = 0.5f * (bounds.least + bounds.most);
  const float spread = 0.5f * glm::length(bounds.most - bounds.least);
  order_.clear();
  std::size_t step = 1;
  for (std::size_t m = 0; m < count; m += step) {
    const int index = list.members[m];
    step = static_cast<std::size_t>(std::max(1, list.views[m]));
    const ImpostorLines& lines = frame_->lines[static_cast<std::size_t>(index)];
    if (bounds.mayMeet(lines.centre, lines.radius)) {
      const float distance = glm::length(lines.centre - middle) - lines.radius - spread;
      order_.emplace_back(distance > 0.0f ? distance : 0.0f, index, static_cast<int>(m));
    } else {
      counts_->culled += rays.count;
    }
  }
  std::ranges::sort(order_);
  float farthest = kNothing;
  for (std::size_t k = 0; k < order_.size(); ++k) {
    // Nothing from here on is nearer than what all rays have met
    if (std::get<float>(order_[k]) > farthest) {
      counts_->culled += rays.count * (order_.size() - k);
      return;
    }
    const auto [distance, index, place] = order_[k];
    const int views = list.views[static_cast<std::size_t>(place)];
    const std::span<const int> members =
        std::span(list.members).subspan(static_cast<std::size_t>(place));
    if (views > 0 ? meetViews(rays, members.first(static_cast<std::size_t>(views)))
                  : meet(rays, index, frame_->lines[static_cast<std::size_t>(index)]))
      farthest = impostors::farthest(rays);
  }
}

bool TileRays::meet(RayBatch& rays, int index, const ImpostorLines& lines) {
  looks_.count = 0;
  if (lines.way == shared::kWayDepth) {
    meetDepthMap(rays, lines);
  } else {
    const bool box = lines.way == shared::kWayBox || lines.way == shared::kWayShared;
    const bool any = box ? meetBox(lines.quad, lines.height * lines.side, rays, met_)
                         : meetQuad(lines.quad, rays, met_);
    if (!any) return false;
    for (std::size_t i = 0; i < rays.count; ++i) {
      if (met_.on[i] == 0) continue;
      hits_[looks_.count] = static_cast<std::uint16_t>(i);
      looks_.u[looks_.count] = met_.u[i];
      looks_.v[looks_.count] = met_.v[i];
      ++looks_.count;
    }
    if (!box) std::fill_n(met_.share.begin(), rays.count, 0.0f);
  }
  if (looks_.count == 0) return false;
  take(rays, index, lines);
  return true;
}

void TileRays::meetDepthMap(RayBatch& rays, const ImpostorLines& lines) {
  const auto size = static_cast<float>(colorsOf(lines).levels().front().size);
  if (lines.begin > 0.0f) {
    keptOrigins_ = rays.origin;
    keptT_ = rays.t;
    for (std::size_t i = 0; i < rays.count; ++i) {
      rays.origin.set(i, rays.origin.at(i) + lines.begin * rays.direction.at(i));
      rays.t[i] -= lines.begin;
    }
    project(lines.rows, size, rays, map_);
    rays.origin = keptOrigins_;
    rays.t = keptT_;
    const Vec3 forward(lines.quad.plane);
    for (std::size_t i = 0; i < rays.count && !several_; ++i)
      if (glm::dot(forward, rays.direction.at(i)) < shared::kSelfCosine) map_.on[i] = 0;
  } else {
    project(lines.rows, size, rays, map_);
  }
  map_.steepest = several_ ? lines.steepest : 0.0f;
  if (several_) {
    hidden_.fill(0.0f);
    for (std::size_t i = 0; i < rays.count; ++i) map_.on[i] &= wanted_[i] ? 1 : 0;
  }
  // Those whose rest is not empty, in a row
  std::size_t count = 0;
  for (std::size_t i = 0; i < rays.count; ++i) {
    if (map_.on[i] == 0) continue;
    map_.ray[count] = static_cast<std::uint16_t>(i);
    for (Lane* lane : {&map_.fromX, &map_.fromY, &map_.fromG, &map_.toX, &map_.toY, &map_.toG,
                       &map_.tFrom, &map_.tTo, &map_.wFrom, &map_.wTo})
      (*lane)[count] = (*lane)[i];
    ++count;
  }
  map_.count = count;
  counts_->clipped += rays.count - count;
  counts_->searched += count;
  if (count == 0) return;
  counts_->work += frame_->meetMap(lines.layer, map_);
  counts_->texels += map_.texels;
  for (std::size_t k = 0; k < count; ++k) {
    const bool hides = several_ && map_.at[k] >= shared::kHidden;
    const float share = hides ? map_.at[k] - shared::kHidden : map_.at[k];
    if (!(share <= 1.0f)) continue;
    const float near = (1.0f - share) * map_.wTo[k];
    const float far = share * map_.wFrom[k];
    const float t = lines.begin + (map_.tFrom[k] * near + map_.tTo[k] * far) / (near + far);
    const std::size_t i = map_.ray[k];
    if (hides) hidden_[i] = std::max(t, std::numeric_limits<float>::min());
    if (hides || !(t < rays.t[i])) continue;
    met_.t[i] = t;
    met_.share[i] = 0.0f;
    hits_[looks_.count] = static_cast<std::uint16_t>(i);
    const auto within = [](float x) { return std::clamp(x, 0.0f, 1.0f); };
    looks_.u[looks_.count] = within((map_.fromX[k] + share * (map_.toX[k] - map_.fromX[k])) / size);
    looks_.v[looks_.count] = within((map_.fromY[k] + share * (map_.toY[k] - map_.fromY[k])) / size);
    ++looks_.count;
  }
}

bool TileRays::meetViews(RayBatch& rays, std::span<const int> views) {
  std::array<std::uint32_t, kMostRays> asked{};
  std::array<std::size_t, kMostRays> next;
  Lane hidden;  // 0: nowhere
  hidden.fill(kNothing);
  const auto linesOf = [&](std::size_t v) -> const ImpostorLines& {
    return frame_->lines[static_cast<std::size_t>(views[v])];
  };
  bool any = false;
  several_ = true;
  for (std::size_t round = 0; round < views.size(); ++round) {
    bool left = false;
    for (std::size_t i = 0; i < rays.count; ++i) {
      next[i] = views.size();
      float best = -2.0f;
      for (std::size_t v = 0; v < views.size() && hidden[i] > 0.0f; ++v) {
        const float facing = glm::dot(Vec3(linesOf(v).quad.plane), rays.direction.at(i));
        if ((asked[i] >> v & 1u) != 0 || !(facing > best)) continue;
        best = facing;
        next[i] = v;
      }
      left = left || next[i] < views.size();
    }
    if (!left) break;
    for (std::size_t v = 0; v < views.size(); ++v) {
      bool wanted = false;
      for (std::size_t i = 0; i < rays.count; ++i) {
        wanted_[i] = next[i] == v;
        if (!wanted_[i]) continue;
        wanted = true;
        asked[i] |= 1u << v;
      }
      if (!wanted) continue;
      any = meet(rays, views[v], linesOf(v)) || any;
      for (std::size_t i = 0; i < rays.count; ++i)
        if (wanted_[i]) hidden[i] = std::min(hidden[i], hidden_[i]);
    }
  }
  several_ = false;
  for (std::size_t i = 0; i < rays.count; ++i)
    if (hidden[i] > 0.0f) rays.hidden[i] = std::min(rays.hidden[i], hidden[i]);
  return any;
}

void TileRays::take(RayBatch& rays, int index, const ImpostorLines& lines) {
  const Vec3 normal(lines.quad.plane);
  for (std::size_t k = 0; k < looks_.count; ++k) {
    const std::size_t i = hits_[k];
    width_[k] = rays.distance[i] + met_.t[i];
    slant_[k] = glm::dot(normal, rays.direction.at(i));
  }
  levels(spread_ / lines.texelMetres, width_, slant_, looks_);
  const bool depth = lines.way == shared::kWayDepth;
  const bool shared = lines.way == shared::kWayShared;
  if (!shared) lookUp(colorsOf(lines), looks_);
  wider_.count = 0;
  for (std::size_t k = 0; k < looks_.count; ++k) {
    const std::size_t i = hits_[k];
    Vec3 color = looks_.color.at(k);
    float alpha = shared ? 1.0f : looks_.alpha[k];
    if (depth && alpha < kCovered) {
      // A depth map knows what is hit; over its outline look at what is beside
      wider_.count = 1;
      wider_.u[0] = looks_.u[k];
      wider_.v[0] = looks_.v[k];
      wider_.level[0] = looks_.level[k] + 2.0f;
      lookUp(colorsOf(lines), wider_);
      color = wider_.color.at(0);
      alpha = wider_.alpha[0];
    }
    if (!(depth ? alpha > 1e-3f : alpha >= kCovered)) continue;
    rays.t[i] = met_.t[i];
    rays.color.set(i, shared ? Vec3(0.0f) : color / alpha);
    rays.u[i] = looks_.u[k];
    rays.v[i] = looks_.v[k];
    rays.level[i] = looks_.level[k];
    rays.share[i] = met_.share[i];
    rays.impostor[i] = index;
  }
}

void TileRays::shadeWalls(RayBatch& rays) {
  const Vec3 centre = frame_->bounds.centre();
  const Surroundings around{&frame_->cube, frame_->bounds.min, frame_->bounds.max, centre};
  for (std::size_t i = 0; i < rays.count; ++i) {
    if (!rays.found(i)) continue;
    const float share = rays.share[i];
    if (share > 0.0f) rays.marks[i] |= raster::kMaskTransition;
    const int way = frame_->lines[static_cast<std::size_t>(rays.impostor[i])].way;
    if (way != shared::kWayShared && !(share > 0.0f)) continue;
    const Vec3 direction = rays.direction.at(i);
    EnvironmentLookUps& at = around_;
    at.count = 1;
    at.origin.set(0, rays.origin.at(i));
    // The blended ray r_m [Popescu2006, Sec. 3.2]; on the quad itself the ray to the hit
    Vec3 along = direction;
    if (way == shared::kWayShared)
      along = glm::mix(glm::normalize(rays.origin.at(i) + rays.t[i] * direction - centre),
                       direction, share);
    at.direction.set(0, along);
    Surroundings here = around;
    if (way == shared::kWayShared) {
      // By direction alone: from the map's own centre, in no box
      at.origin.set(0, Vec3(0.0f));
      here.centre = here.least = here.most = Vec3(0.0f);
    }
    environment(here, at);
    const float weight = way == shared::kWayShared ? 1.0f : share;
    rays.color.set(i, glm::mix(rays.color.at(i), at.color.at(0), weight));
  }
}

void TileRays::addEnvironment(RayBatch& rays) {
  around_.count = 0;
  for (std::size_t i = 0; i < rays.count; ++i) {
    if (rays.found(i)) continue;
    const std::size_t k = around_.count++;
    hits_[k] = static_cast<std::uint16_t>(i);
    around_.origin.set(k, rays.origin.at(i));
    around_.direction.set(k, rays.direction.at(i));
  }
  if (around_.count == 0) return;
  environment({&frame_->cube, frame_->bounds.min, frame_->bounds.max, frame_->bounds.centre()},
              around_);
  const float fade = frame_->options.attenuation;
  for (std::size_t k = 0; k < around_.count; ++k) {
    const std::size_t i = hits_[k];
    const float kept =
        fade > 0.0f
            ? std::exp(-(around_.closed[k] > 0.999f ? around_.t[k] : trace::kSkyMetres) / fade)
            : 1.0f;
    rays.color.set(i, rays.color.at(i) + kept * around_.color.at(k));
    rays.marks[i] |= raster::kMaskEnvironment;
  }
}

void TileRays::goOn() {
  // By reflector, in the order in which the rays meet them
  std::array<bool, kMostRays> open{};
  for (std::size_t i = 0; i < first_.count; ++i)
    open[i] =
        first_.found(i) && frame_->lines[static_cast<std::size_t>(first_.impostor[i])].reflective;
  for (std::size_t begin = 0; begin < first_.count; ++begin) {
    if (!open[begin]) continue;
    const auto objectOf = [&](std::size_t i) {
      return frame_->lines[static_cast<std::size_t>(first_.impostor[i])].object;
    };
    second_.count = 0;
    second_.object = objectOf(begin);
    for (std::size_t i = begin; i < first_.count; ++i) {
      if (!open[i] || objectOf(i) != second_.object) continue;
      open[i] = false;
      from_[second_.count++] = static_cast<std::uint16_t>(i);
    }
    followBatch();
  }
}

void TileRays::followBatch() {
  for (std::size_t k = 0; k < second_.count; ++k) {
    const std::size_t i = from_[k];
    const ImpostorLines& lines = frame_->lines[static_cast<std::size_t>(first_.impostor[i])];
    const std::vector<HalfImage>& normals = lines.plane ? frame_->planeNormals : frame_->normals;
    wider_.count = 1;
    wider_.u[0] = first_.u[i];
    wider_.v[0] = first_.v[i];
    wider_.level[0] = first_.level[i];
    const auto layer = static_cast<std::size_t>(lines.layer);
    lookUp(normals[2 * layer + 1], wider_);
    specular_[k] = wider_.color.x[0] / std::max(wider_.alpha[0], 1e-6f);
    lookUp(normals[2 * layer], wider_);
    const Vec3 direction = first_.direction.at(i);
    Vec3 normal = normalizedOr(wider_.color.at(0), Vec3(0, 1, 0));
    if (glm::dot(normal, direction) > 0.0f) normal = -normal;
    second_.origin.set(k, first_.origin.at(i) + first_.t[i] * direction);
    second_.direction.set(k, glm::reflect(direction, normal));
    second_.distance[k] = first_.distance[i] + first_.t[i];
    second_.marks[k] = 0;
  }
  nearest(second_, !frame_->options.secondDiffuse);
  fade(second_);
  addEnvironment(second_);
  counts_->secondOrder += second_.count;
  for (std::size_t k = 0; k < second_.count; ++k) {
    const std::size_t i = from_[k];
    const Vec3 tint = frame_->lines[static_cast<std::size_t>(first_.impostor[i])].tint;
    const float s = specular_[k];
    first_.color.set(i, (1.0f - s) * first_.color.at(i) + s * tint * second_.color.at(k));
    first_.marks[i] |= second_.marks[k];
  }
}

}  // namespace catoptric::methods::impostors
