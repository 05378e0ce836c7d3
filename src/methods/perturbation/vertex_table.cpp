#include "methods/perturbation/vertex_table.h"

namespace catoptric::methods::perturbation {

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
  scratch_.welding.weld(positions_.size(),
                        [&](std::size_t v) { return std::array{positions_[v]}; });
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
