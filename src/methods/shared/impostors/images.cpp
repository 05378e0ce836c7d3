#include "methods/shared/impostors/images.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "gl/draw_state.h"
#include "raster/draw.h"

namespace catoptric::methods::impostors {

bool Images::Slot::shows(const Impostor& impostor) const {
  return used && object == impostor.object && slab == impostor.slab && depth == impostor.depth &&
         peeled == impostor.peeled && camera == impostor.camera;
}

void Images::prepare(int textureSize, const Kept& kept) {
  size_ = textureSize;
  kept_ = kept;
  color_ = gl::Texture::make2D("impostor", GL_RGBA16F, size_, size_, 0);
  depth_ = gl::Texture::make2D("impostor's depth", GL_DEPTH_COMPONENT32F, size_, size_);
  target_ = gl::Framebuffer("impostor", {{.texture = color_}}, {.texture = depth_});
  if (!kept_.normals) return;
  normal_ = gl::Texture::make2D("impostor's normals", GL_RGBA16F, size_, size_, 0);
  specular_ = gl::Texture::make2D("impostor's specular level", GL_RGBA16F, size_, size_, 0);
  reflectiveTarget_ = gl::Framebuffer(
      "reflective impostor", {{.texture = color_}, {.texture = normal_}, {.texture = specular_}},
      {.texture = depth_});
}

void Images::forget(std::span<const int> objects) {
  for (Slot& slot : slots_)
    if (std::find(objects.begin(), objects.end(), slot.object) != objects.end()) slot.used = false;
}

void Images::forgetAll() {
  for (Slot& slot : slots_) slot.used = false;
}

void Images::retain(const std::vector<Impostor>& impostors) {
  std::multimap<int, const Impostor*> byObject;
  for (const Impostor& impostor : impostors) byObject.emplace(impostor.object, &impostor);
  for (Slot& slot : slots_) {
    const auto [begin, end] = byObject.equal_range(slot.object);
    slot.used = std::any_of(begin, end, [&](const auto& of) { return slot.shows(*of.second); });
  }
}

void Images::limit(std::size_t most) {
  if (slots_.size() <= most) return;
  slots_.clear();
  colorsInMemory_.clear();
  normalsInMemory_.clear();
  colors_ = {};
  normals_ = {};
  depths_ = {};
}

std::uint64_t Images::bytesOf(int textureSize, const Kept& kept, bool reflective) {
  const auto side = static_cast<std::uint64_t>(textureSize) + 2;
  constexpr std::uint64_t kTexelBytes = 8;
  const std::uint64_t image = kTexelBytes * side * side * 4 / 3;  // with mip levels
  // On the device all layers have normals and depths
  const std::uint64_t depths = kept.depths ? sizeof(float) * side * side : 0;
  return (kept.inMemory ? (kept.normals && reflective ? 3 : 1) * image : 0) +
         (kept.onDevice ? (kept.normals ? 3 : 1) * image + depths : 0);
}

bool Images::grow(std::size_t layers, std::size_t most) {
  if (layers <= slots_.size()) return false;
  const std::size_t count = std::max(layers, std::min(2 * slots_.size(), most));
  if (kept_.onDevice) slots_.clear();  // the textures are made anew
  slots_.resize(count);
  if (kept_.inMemory) {
    colorsInMemory_.resize(slots_.size());
    if (kept_.normals) normalsInMemory_.resize(2 * slots_.size());
  }
  if (!kept_.onDevice) return true;
  colors_ =
      gl::Texture::makeArray("impostors", GL_RGBA16F, size_, size_, static_cast<int>(count), 0);
  colors_.setFilter(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
  if (kept_.normals) {
    // Two layers each: normals, s
    normals_ = gl::Texture::makeArray("impostors' normals", GL_RGBA16F, size_, size_,
                                      2 * static_cast<int>(count), 0);
    normals_.setFilter(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
  }
  if (kept_.depths)
    depths_ = gl::Texture::makeArray("depth maps", GL_R32F, size_, size_, static_cast<int>(count));
  return true;
}

std::vector<int> Images::keep(const std::vector<Impostor>& impostors, std::span<const int> needed) {
  reused_ = 0;
  layerOf_.assign(impostors.size(), -1);
  std::vector<bool> taken(slots_.size(), false);
  std::vector<int> fresh;
  for (const int index : needed) {
    const Impostor& impostor = impostors[static_cast<std::size_t>(index)];
    std::size_t s = 0;
    while (s < slots_.size() && (taken[s] || !slots_[s].shows(impostor))) ++s;
    if (s == slots_.size()) {
      fresh.push_back(index);
      continue;
    }
    taken[s] = true;
    slots_[s].neededBy = updates_;
    layerOf_[static_cast<std::size_t>(index)] = static_cast<int>(s);
    ++reused_;
  }
  return fresh;
}

void Images::update(Services& services, const std::vector<Impostor>& impostors,
                    std::span<const int> needed, std::size_t most, const Drawn& drawn) {
  drawn_ = reused_ = 0;
  ++updates_;
  drawnNow_.assign(impostors.size(), false);
  std::vector<int> fresh = keep(impostors, needed);
  if (fresh.empty()) return;
  // More slots rather than images drawn again, as far as `most` allows
  const auto used = static_cast<std::size_t>(std::ranges::count(slots_, true, &Slot::used));
  if (grow(std::max(needed.size(), std::min(most, used + fresh.size())), most))
    fresh = keep(impostors, needed);
  std::vector<std::size_t> free;
  for (std::size_t s = 0; s < slots_.size(); ++s)
    if (!slots_[s].used || slots_[s].neededBy < updates_) free.push_back(s);
  // Unused slots first, then images that were needed longest ago
  std::ranges::stable_sort(free, {},
                           [&](std::size_t s) { return slots_[s].used ? slots_[s].neededBy : 0; });
  for (std::size_t k = 0; k < fresh.size(); ++k)
    layerOf_[static_cast<std::size_t>(fresh[k])] = static_cast<int>(free[k]);
  services.timer.measure("impostors", [&] {
    for (const int index : fresh) {
      const Impostor& impostor = impostors[static_cast<std::size_t>(index)];
      const int layer = layerOf(index);
      const std::uint64_t clamped = draw(services, impostor, layer, drawn, index);
      slots_[static_cast<std::size_t>(layer)] = {.used = true,
                                                 .slab = impostor.slab,
                                                 .depth = impostor.depth,
                                                 .object = impostor.object,
                                                 .peeled = impostor.peeled,
                                                 .camera = impostor.camera,
                                                 .clampedTexels = clamped,
                                                 .neededBy = updates_};
      drawnNow_[static_cast<std::size_t>(index)] = true;
      ++drawn_;
    }
  });
}

std::uint64_t Images::clampedTexels() const {
  std::uint64_t sum = 0;
  for (const int layer : layerOf_)
    if (layer >= 0) sum += slots_[static_cast<std::size_t>(layer)].clampedTexels;
  return sum;
}

std::uint64_t Images::draw(Services& services, const Impostor& impostor, int layer,
                           const Drawn& drawn, int index) {
  const bool normals = kept_.normals && impostor.reflective;
  const gl::Framebuffer& target = normals ? reflectiveTarget_ : target_;
  const gl::DrawScope scope{gl::DrawState()};
  const Camera& camera = impostor.camera;
  const float spread = std::sqrt(camera.size.x * camera.size.y) / static_cast<float>(size_);
  // One surface after the other is peeled off
  for (int surface = 0; surface <= impostor.peeled; ++surface) {
    if (surface > 0) {
      if (before_.empty())
        before_ = gl::Texture::make2D("peeled depths", GL_DEPTH_COMPONENT32F, size_, size_);
      glCopyImageSubData(depth_.id(), GL_TEXTURE_2D, 0, 0, 0, 0, before_.id(), GL_TEXTURE_2D, 0, 0,
                         0, 0, size_, size_, 1);
    }
    target.bind();
    target.clearDepth(0.0f);
    for (int i = 0; i < (normals ? 3 : 1); ++i) target.clearColor(i, 0.0f, 0.0f, 0.0f, 0.0f);
    services.raster->drawDiffuse(
        camera.clipFromWorld(), camera.eye, spread, services.lighting,
        {.objects = raster::ObjectSet::only({impostor.object + 1}),
         .outputs = {.radiance = true, .normal = normals, .specular = normals},
         .background = false,
         .behind = surface > 0 ? &before_ : nullptr});
  }
  const auto keep = [](gl::Texture& from, const gl::Texture& to, int at) {
    from.generateMipmaps();
    for (int level = 0; level < to.levels(); ++level)
      glCopyImageSubData(from.id(), GL_TEXTURE_2D, level, 0, 0, 0, to.id(), GL_TEXTURE_2D_ARRAY,
                         level, 0, 0, at, to.levelWidth(level), to.levelHeight(level), 1);
  };
  if (kept_.onDevice) {
    keep(color_, colors_, layer);
    if (normals) {
      keep(normal_, normals_, 2 * layer);
      keep(specular_, normals_, 2 * layer + 1);
    }
  }
  std::uint64_t clamped = 0;
  if (kept_.inMemory) {
    const auto at = static_cast<std::size_t>(layer);
    clamped = colorsInMemory_[at].read(color_);
    if (normals) {
      normalsInMemory_[2 * at].read(normal_);
      normalsInMemory_[2 * at + 1].read(specular_);
    }
  } else {
    clamped = raster::clampedTexels(color_);
  }
  texels_.clear();
  if (impostor.depth) {
    texels_ = raster::readDepth(depth_);
    if (kept_.onDevice) depths_.upload(0, layer, GL_RED, GL_FLOAT, texels_.data());
  }
  if (drawn) drawn(index, layer, texels_);
  return clamped;
}

}  // namespace catoptric::methods::impostors
