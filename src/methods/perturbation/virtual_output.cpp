#include "methods/perturbation/virtual_output.h"

#include "core/parallel.h"

namespace catoptric::methods::perturbation {
namespace {

/// Vertices that a thread puts out in one go.
constexpr std::size_t kPutGrain = 4096;

}  // namespace

void VirtualOutput::numberVertices() {
  const std::size_t old = numbers.size();
  numbers.resize(table_.vertexCount());
  std::size_t end = putOut_;
  for (std::size_t v = old; v < numbers.size(); ++v) {
    numbers[v] = {static_cast<std::uint32_t>(end),
                  table_.glimpses[table_.placeOf(static_cast<std::uint32_t>(v))].count};
    end += numbers[v].count;
  }
  makeRoom(end);
  parallelFor(numbers.size() - old, kPutGrain, [&](std::size_t begin, std::size_t last) {
    for (std::size_t v = old + begin; v < old + last; ++v) {
      const auto vertex = static_cast<std::uint32_t>(v);
      for (std::uint32_t i = 0; i < numbers[v].count; ++i) {
        putOut(numbers[v].first + i, vertex, table_.placeAt(vertex).reflections.at[i],
               table_.seen(table_.placeOf(vertex), i));
      }
    }
  });
  putOut_ = end;
}

void VirtualOutput::makeRoom(std::size_t vertices) {
  if (result_.positions.size() < vertices) {
    result_.positions.resize(vertices);
    result_.attributes.resize(vertices);
    result_.images.resize(vertices);
  }
  if (seenVertices_.size() < vertices) seenVertices_.resize(vertices);
  if (keepsPlaces_ && result_.places.size() < vertices) result_.places.resize(vertices);
}

void VirtualOutput::putOut(std::size_t number, std::uint32_t vertex, const Reflection& r,
                           const Vec2& seen) {
  result_.positions[number] = Vec3(table_.placeAt(vertex).position);
  result_.attributes[number] = table_.attributesOf(vertex);
  result_.images[number] = Vec4(r.image, r.share);
  if (keepsPlaces_) result_.places[number] = Vec3(r.last);
  seenVertices_[number] = seen;
}

std::uint32_t VirtualOutput::put(std::uint32_t vertex, std::size_t reflection) {
  if (vertex < numbers.size() && reflection < numbers[vertex].count)
    return numbers[vertex].first + static_cast<std::uint32_t>(reflection);
  const auto [known, isNew] =
      putMore_.try_emplace({vertex, reflection}, static_cast<std::uint32_t>(putOut_));
  if (!isNew) return known->second;
  const bool straight = reflection == kMaxReflections;
  const VertexPlace& place = table_.placeAt(vertex);
  const Reflection& r = straight ? *place.straight : place.reflections.at[reflection];
  makeRoom(putOut_ + 1);
  putOut(putOut_++, vertex, r,
         straight ? table_.seenAt(r) : table_.seen(table_.placeOf(vertex), reflection));
  return known->second;
}

void VirtualOutput::finish(int object) {
  result_.object = object + 1;
  result_.positions.resize(putOut_);
  result_.attributes.resize(putOut_);
  result_.images.resize(putOut_);
  result_.places.resize(keepsPlaces_ ? putOut_ : 0);
}

}  // namespace catoptric::methods::perturbation
