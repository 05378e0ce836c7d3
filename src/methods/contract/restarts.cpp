#include "methods/contract/restarts.h"

#include <algorithm>
#include <cmath>

namespace catoptric::methods {
namespace {

/// A move so many times as large as those beside it is a cut (ours; smooth paths change their speed
/// by less than a half from frame to frame).
constexpr float kCutRatio = 10.0f;
/// Smaller turns are no cut (ours): rounding makes any ratio.
constexpr float kLeastCutRad = 0.01f;

struct Move {
  float metres = 0.0f;
  float turnRad = 0.0f;
};

/// From frame number - 1 to `number`; none at the path's ends.
Move moveTo(const scene::CameraPath& path, int number) {
  if (number < 2 || number > path.count()) return {};
  const scene::Camera a = path.frame(number - 1).camera;
  const scene::Camera b = path.frame(number).camera;
  const float cosine = glm::dot(a.forward(), b.forward());
  return {glm::length(b.eye() - a.eye()), std::acos(std::clamp(cosine, -1.0f, 1.0f))};
}

}  // namespace

bool onRestartGrid(int number, int every) {
  return number == 1 || (every > 0 && (number - 1) % every == 0);
}

bool cutsBefore(const scene::CameraPath& path, int number) {
  if (number < 2) return false;
  const Move move = moveTo(path, number);
  const Move before = moveTo(path, number - 1);
  const Move after = moveTo(path, number + 1);
  // Steps within the near plane's distance are no cut
  const float least = path.frame(number).camera.nearMetres;
  return (move.metres > least && move.metres > kCutRatio * std::max(before.metres, after.metres)) ||
         (move.turnRad > kLeastCutRad &&
          move.turnRad > kCutRatio * std::max(before.turnRad, after.turnRad));
}

std::vector<int> withWarmUp(const Method& method, const scene::CameraPath& path,
                            const std::vector<int>& asked) {
  std::vector<int> all;
  for (const int number : asked) {
    int first = number;
    const int known = all.empty() ? 0 : all.back();
    while (first > 1 && first > known + 1 && !method.restartsAt(path, first)) --first;
    // Between two asked frames without a restart all are rendered; after one, those since it
    for (int i = first; i <= number; ++i) all.push_back(i);
  }
  return all;
}

}  // namespace catoptric::methods
