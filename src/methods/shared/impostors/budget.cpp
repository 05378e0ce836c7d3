#include "methods/shared/impostors/budget.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "methods/shared/impostors/ray_batch.h"

namespace catoptric::methods::impostors {
namespace {

/// Time of a traced ray, and of a sample of the G-buffer and the composite, in texels of a
/// billboard. Ours, measured on llvmpipe and Embree: 0.2 us, 0.3 us and 50 ns.
constexpr double kTexelsPerRay = 4.0;
constexpr double kTexelsPerSample = 6.0;
/// Part of the time of a traced frame that images may take. Ours.
constexpr double kShare = 0.5;
/// A reflector's images may take so many times the time of its traced rays, if the frame has time
/// to spare. Ours.
constexpr double kDear = 16.0;

}  // namespace

double allowedTexels(std::uint64_t samples, std::uint64_t rays) {
  return kShare * (kTexelsPerSample * static_cast<double>(samples) +
                   kTexelsPerRay * static_cast<double>(rays));
}

double beyondTracing(double texels, std::uint64_t rays) {
  return std::max(0.0, texels - kTexelsPerRay * static_cast<double>(rays));
}

std::vector<bool> grant(std::span<const Wish> wishes, std::span<const Cost> costs,
                        const Cost& most) {
  std::vector<double> askers(costs.size(), 0.0);
  for (const Wish& wish : wishes)
    for (const int image : wish.images) askers[static_cast<std::size_t>(image)] += 1.0;
  // A reflector with fewer rays than any image is worth would show the environment map alone
  double one = std::numeric_limits<double>::infinity();
  for (const Cost& cost : costs) one = std::min(one, cost.texels);
  // What several reflectors share is paid by all of them
  std::vector<double> raysPerTexel;
  std::vector<bool> dear;
  for (const Wish& wish : wishes) {
    double texels = wish.texels;
    for (const int image : wish.images)
      texels +=
          costs[static_cast<std::size_t>(image)].texels / askers[static_cast<std::size_t>(image)];
    const auto rays = static_cast<double>(wish.rays);
    raysPerTexel.push_back(rays / std::max(texels, 1e-9));
    dear.push_back(!costs.empty() && std::max(texels, one) > kDear * kTexelsPerRay * rays);
  }
  std::vector<std::size_t> order(wishes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater(),
                           [&](std::size_t w) { return raysPerTexel[w]; });
  std::vector<bool> granted(wishes.size(), false);
  std::vector<bool> drawn(costs.size(), false);
  Cost sum;
  for (const std::size_t w : order) {
    Cost with = sum;
    with.texels += wishes[w].texels;
    for (const int image : wishes[w].images)
      if (!drawn[static_cast<std::size_t>(image)]) with.add(costs[static_cast<std::size_t>(image)]);
    if (dear[w] || !with.within(most)) continue;
    granted[w] = true;
    sum = with;
    for (const int image : wishes[w].images) drawn[static_cast<std::size_t>(image)] = true;
  }
  return granted;
}

namespace {

constexpr int kEdge = 16;  ///< samples along an edge; a tile's are at most kMostRays

/// How many rays may meet it.
std::size_t meeting(const RayBatch& rays, const Reach& reach) {
  constexpr float kRounding = 1e-4f;  ///< of the squared radius; ours
  const float radius2 = reach.radius * reach.radius * (1.0f + kRounding);
  std::size_t count = 0;
  for (std::size_t i = 0; i < rays.count; ++i) {
    const Vec3 way = reach.centre - rays.origin.at(i);
    const float far2 = glm::dot(way, way);
    const float along = glm::dot(way, rays.direction.at(i));
    count += far2 <= radius2 || (along > 0.0f && far2 - along * along <= radius2) ? 1 : 0;
  }
  return count;
}

}  // namespace

struct Demand::Tile {
  const raster::GBufferCopy& samples;
  const trace::SampleCamera& camera;
  int x0, y0;
};

Demand::Demand(const raster::GBufferCopy& samples, const scene::Camera& camera,
               std::span<const Rays> raysOf, std::span<const ImpostorList> lists,
               std::span<const Reach> reaches)
    : raysOf_(raysOf),
      lists_(lists),
      reaches_(reaches),
      samplesOf_(lists.size()),
      testsOf_(lists.size()) {
  std::size_t members = 0;
  for (const ImpostorList& list : lists) {
    firstOf_.push_back(members);
    members += list.members.size();
  }
  met_ = std::vector<std::atomic<bool>>(members);
  const int width = samples.sampleWidth();
  const trace::SampleCamera eye{camera.eye(), camera.nearMetres,
                                scene::rayFromPixel(camera, width, samples.sampleHeight())};
  const int columns = (width + kEdge - 1) / kEdge;
  const int rows = (samples.rows + kEdge - 1) / kEdge;
  parallelFor(static_cast<std::size_t>(rows), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      for (int column = 0; column < columns; ++column)
        lookAt({samples, eye, column * kEdge, static_cast<int>(row) * kEdge});
  });
}

void Demand::lookAt(const Tile& tile) {
  const raster::GBufferCopy& from = tile.samples;
  std::array<std::uint32_t, kMostRays> places;
  std::size_t count = 0;
  for (int y = tile.y0; y < std::min(from.rows, tile.y0 + kEdge); ++y) {
    for (int x = tile.x0; x < std::min(from.sampleWidth(), tile.x0 + kEdge); ++x) {
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(from.sampleWidth()) +
                      static_cast<std::size_t>(x);
      if (from.object[at] > 0 && raysOf_[from.object[at] - 1] != Rays::None && from.depth[at] > 0)
        places[count++] = static_cast<std::uint32_t>(at);
    }
  }
  std::sort(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(count),
            [&](std::uint32_t a, std::uint32_t b) {
              return std::pair(from.object[a], a) < std::pair(from.object[b], b);
            });
  static thread_local Samples samples;
  static thread_local RayBatch rays;
  for (std::size_t begin = 0; begin < count;) {
    const std::uint32_t id = from.object[places[begin]];
    rays.count = 0;
    for (; begin < count && from.object[places[begin]] == id; ++begin) {
      const std::size_t at = places[begin];
      const std::size_t k = rays.count++;
      const std::size_t row = at / static_cast<std::size_t>(from.sampleWidth());
      const std::size_t column = at - row * static_cast<std::size_t>(from.sampleWidth());
      samples.x[k] = static_cast<float>(column) + 0.5f;
      samples.y[k] = static_cast<float>(row) + 0.5f;
      samples.depth[k] = from.depth[at];
      const float* const normal = &from.normal[4 * at];
      samples.normal.set(k, {normal[0], normal[1], normal[2]});
    }
    samplesOf_[id - 1] += rays.count;
    if (raysOf_[id - 1] != Rays::Mirrored) continue;
    aim(tile.camera, samples, rays);
    ask(id - 1, rays);
  }
}

void Demand::ask(std::size_t object, const RayBatch& rays) {
  const RayBounds bounds = bound(rays);
  const ImpostorList& list = lists_[object];
  std::uint64_t tests = 0;
  std::size_t group = 0;  // where the next object's maps begin
  for (std::size_t m = 0; m < list.members.size(); ++m) {
    std::atomic<bool>& met = met_[firstOf_[object] + m];
    const Reach& reach = reaches_[static_cast<std::size_t>(list.members[m])];
    // A ray is tested against one of an object's maps, rarely against more
    const bool counted = reach.depth && m >= group;
    if (m >= group) group = m + static_cast<std::size_t>(std::max(1, list.views[m]));
    if ((met && !counted) || !bounds.mayMeet(reach.centre, reach.radius)) continue;
    const std::size_t count = meeting(rays, reach);
    if (count > 0) met = true;
    if (counted) tests += count;
  }
  testsOf_[object] += tests;
}

ImpostorList Demand::listOf(int object) const {
  const auto o = static_cast<std::size_t>(object);
  const ImpostorList& whole = lists_[o];
  if (raysOf_[o] != Rays::Mirrored) return whole;
  ImpostorList part;
  for (std::size_t m = 0; m < whole.members.size();) {
    // Several depth maps of an object stay together
    const auto group = static_cast<std::size_t>(std::max(1, whole.views[m]));
    bool met = false;
    for (std::size_t k = 0; k < group; ++k) met = met || met_[firstOf_[o] + m + k];
    for (std::size_t k = 0; met && k < group; ++k) {
      part.members.push_back(whole.members[m + k]);
      part.views.push_back(whole.views[m + k]);
    }
    m += group;
    if (m <= static_cast<std::size_t>(whole.diffuse))
      part.diffuse = static_cast<int>(part.members.size());
  }
  return part;
}

}  // namespace catoptric::methods::impostors
