#include "methods/perturbation/vertex_table.h"

#include <bit>

namespace catoptric::methods::perturbation {
namespace {

constexpr std::uint32_t kNone = ~0u;

}  // namespace

frame::VertexAttributes mixed(const frame::VertexAttributes& a, const frame::VertexAttributes& b,
                              float t) {
  const auto mean = [&](const auto& u, const auto& v) { return (1.0f - t) * u + t * v; };
  frame::VertexAttributes m;
  m.normal = mean(a.normal, b.normal);
  m.tangent = mean(a.tangent, b.tangent);
  m.uv0 = mean(a.uv0, b.uv0);
  m.uv1 = mean(a.uv1, b.uv1);
  m.color = mean(a.color, b.color);
  m.bake = mean(a.bake, b.bake);
  return m;
}

void VertexTable::begin(const frame::Geometry& geometry, const frame::ObjectRange& range) {
  attributes_ = std::span(geometry.attributes).subspan(range.firstVertex, range.vertexCount);
  positions_ = std::span(geometry.positions).subspan(range.firstVertex, range.vertexCount);
  const std::size_t count = positions_.size();
  placeOf_.resize(count);
  firstAt_.clear();
  std::vector<std::uint32_t>& slots = scratch_.slots;
  slots.assign(std::bit_ceil(2 * count + 1), kNone);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p = positions_[i] + 0.0f;  // -0 is 0
    const auto bits = std::bit_cast<std::array<std::uint32_t, 3>>(p);
    std::uint64_t hash = bits[0];
    hash = hash * 0x9e3779b97f4a7c15u + bits[1];
    hash = hash * 0x9e3779b97f4a7c15u + bits[2];
    std::size_t slot = (hash * 0x9e3779b97f4a7c15u) >> 32 & (slots.size() - 1);
    while (slots[slot] != kNone && positions_[firstAt_[slots[slot]]] != p)
      slot = (slot + 1) & (slots.size() - 1);
    if (slots[slot] == kNone) {
      slots[slot] = static_cast<std::uint32_t>(firstAt_.size());
      firstAt_.push_back(static_cast<std::uint32_t>(i));
    }
    placeOf_[i] = slots[slot];
  }
  // What they hold is of an update before
  places.resize(firstAt_.size());
  glimpses.resize(firstAt_.size());
}

void VertexTable::project(std::size_t place) {
  const Reflections& reflections = places[place].reflections;
  Glimpse& glimpse = glimpses[place];
  glimpse.count = reflections.count;
  for (std::size_t i = 0; i < std::min<std::size_t>(glimpse.seen.size(), glimpse.count); ++i)
    glimpse.seen[i] = seenAt(reflections.at[i]);
}

}  // namespace catoptric::methods::perturbation
