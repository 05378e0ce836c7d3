#include "measure/error_classes.h"

#include <algorithm>

namespace catoptric::measure {

using image::Image;

Layer findLayer(const Image& image, const Image& reference,
                std::initializer_list<const char*> names) {
  for (const char* name : names)
    for (const Image* candidate : {&image, &reference})
      if (const int channel = candidate->channel(name); channel >= 0) return {candidate, channel};
  return {};
}

Classes::Classes(const Image& image, const Image& reference)
    : width_(image.width), height_(image.height) {
  for (const char* name : {"mask.disoccluded", "mask.clamped", "mask.retraced", "mask.environment",
                           "mask.below_horizon"})
    if (const int c = image.channel(name); c >= 0) masks_.push_back({name, {&image, c}});
  // Masks that we do not know come after those that we do
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    const std::string& name = image.channels[c];
    const auto known = [&](const auto& mask) { return mask.first == name; };
    if (name.starts_with("mask.") && name != "mask.reflective" && name != "mask.glossy" &&
        std::none_of(masks_.begin(), masks_.end(), known))
      masks_.push_back({name, {&image, static_cast<int>(c)}});
  }
  id_ = findLayer(image, reference, {"id.object", "id"});
  glossy_ = findLayer(image, reference, {"mask.glossy", "g"});
  reflective_ = findLayer(image, reference, {"mask.reflective", "s"});
}

std::vector<ErrorClass> Classes::empty() const {
  std::vector<ErrorClass> all;
  for (const auto& mask : masks_) all.push_back({mask.first, {}, {}});
  if (id_) all.push_back({"silhouette", {}, {}});
  if (glossy_) all.push_back({"glossy", {}, {}});
  if (reflective_) all.push_back({"other reflective", {}, {}});
  all.push_back({"rest", {}, {}});
  return all;
}

/// An edge of objects: one of the eight neighbours has another id.
bool Classes::silhouette(int x, int y) const {
  const float own = id_.at(static_cast<std::size_t>(y) * width_ + x);
  for (int j = std::max(0, y - 1); j <= std::min(height_ - 1, y + 1); ++j)
    for (int i = std::max(0, x - 1); i <= std::min(width_ - 1, x + 1); ++i)
      if (id_.at(static_cast<std::size_t>(j) * width_ + i) != own) return true;
  return false;
}

std::set<int> Classes::reflectors() const {
  std::set<int> ids;
  if (!id_ || !reflective_) return ids;
  const Image& layers = *reflective_.image;
  const bool isMask =
      layers.channels[static_cast<std::size_t>(reflective_.channel)] == "mask.reflective";
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * width_ + x;
      const int own = static_cast<int>(id_.at(pixel));
      if (own == 0 || ids.contains(own)) continue;
      const float value = reflective_.at(pixel);
      if (isMask ? value >= 1.0f : value > 0.0f && !silhouette(x, y)) ids.insert(own);
    }
  return ids;
}

void Classes::count(std::vector<ErrorClass>& all, int x, int y, bool isReflective,
                    const ErrorShare& share) const {
  const std::size_t pixel = static_cast<std::size_t>(y) * width_ + x;
  std::size_t next = 0;
  bool owned = false;
  const auto member = [&](bool belongs) {
    ErrorClass& one = all[next++];
    if (!belongs) return;
    one.all.add(share);
    if (!owned) one.own.add(share);
    owned = true;
  };
  for (const auto& mask : masks_) member(mask.second.at(pixel) > 0.0f);
  if (id_) member(silhouette(x, y));
  if (glossy_) member(isReflective && glossy_.at(pixel) > 0.0f);
  if (reflective_) member(isReflective && !owned);
  member(!owned);
}

}  // namespace catoptric::measure
