#include "methods/shared/impostors/images.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "gl/draw_state.h"
#include "raster/draw.h"

namespace catoptric::methods::impostors {

namespace {

/// Copies the layers of a smaller array, which may be empty.
gl::Texture withLayersOf(const gl::Texture& smaller, gl::Texture array) {
  for (int level = 0; level < smaller.levels(); ++level)
    glCopyImageSubData(smaller.id(), GL_TEXTURE_2D_ARRAY, level, 0, 0, 0, array.id(),
                       GL_TEXTURE_2D_ARRAY, level, 0, 0, 0, smaller.levelWidth(level),
                       smaller.levelHeight(level), smaller.layers());
  return array;
}

}  // namespace

bool Images::Slot::hasShapeOf(const Impostor& other) const {
  return shaped && impostor.object == other.object && impostor.slab == other.slab &&
         impostor.depth == other.depth && impostor.peeled == other.peeled &&
         impostor.rest == other.rest && (other.rest || impostor.camera == other.camera);
}

void Images::prepare(int textureSize, const Kept& kept, const RestPose* rest) {
  size_ = textureSize;
  kept_ = kept;
  rest_ = rest;
  color_ = gl::Texture::make2D("impostor", GL_RGBA16F, size_, size_, 0);
  depth_ = gl::Texture::make2D("impostor's depth", GL_DEPTH_COMPONENT32F, size_, size_);
  target_ = gl::Framebuffer("impostor", {{.texture = color_}}, {.texture = depth_});
  const bool unlit = rest_ != nullptr && kept_.inMemory;
  if (!kept_.normals && !unlit) return;
  normal_ = gl::Texture::make2D("impostor's normals", GL_RGBA16F, size_, size_, 0);
  if (kept_.normals) {
    specular_ = gl::Texture::make2D("impostor's specular level", GL_RGBA16F, size_, size_, 0);
    reflectiveTarget_ = gl::Framebuffer(
        "reflective impostor", {{.texture = color_}, {.texture = normal_}, {.texture = specular_}},
        {.texture = depth_});
  }
  if (!unlit) return;
  factors_ = gl::Texture::make2D("impostor's factors of light", GL_RGBA16F, size_, size_, 1);
  unlitTarget_ = gl::Framebuffer("unlit impostor",
                                 {{.texture = color_}, {.texture = normal_}, {.texture = factors_}},
                                 {.texture = depth_});
}

void Images::forget(std::span<const int> objects) {
  for (Slot& slot : slots_) {
    if (std::ranges::find(objects, slot.impostor.object) == objects.end()) continue;
    slot.colored = false;
    if (!slot.impostor.rest) slot.shaped = false;
  }
}

void Images::forgetAll() {
  for (Slot& slot : slots_) slot.shaped = slot.colored = false;
}

void Images::forgetColors() {
  for (Slot& slot : slots_) slot.colored = false;
}

void Images::retain(const std::vector<Impostor>& impostors) {
  std::multimap<int, const Impostor*> byObject;
  for (const Impostor& impostor : impostors) byObject.emplace(impostor.object, &impostor);
  for (Slot& slot : slots_) {
    const auto [begin, end] = byObject.equal_range(slot.impostor.object);
    slot.shaped =
        std::any_of(begin, end, [&](const auto& of) { return slot.hasShapeOf(*of.second); });
  }
}

void Images::limit(std::size_t most) {
  if (slots_.size() <= most) return;
  slots_.clear();
  colorsInMemory_.clear();
  normalsInMemory_.clear();
  unlit_.clear();
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

void Images::grow(std::size_t layers, std::size_t most) {
  if (layers <= slots_.size()) return;
  const std::size_t count = std::max(layers, std::min(2 * slots_.size(), most));
  slots_.resize(count);
  if (kept_.inMemory) {
    colorsInMemory_.resize(slots_.size());
    if (kept_.normals) normalsInMemory_.resize(2 * slots_.size());
  }
  if (!kept_.onDevice) return;
  colors_ = withLayersOf(colors_, gl::Texture::makeArray("impostors", GL_RGBA16F, size_, size_,
                                                         static_cast<int>(count), 0));
  colors_.setFilter(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
  if (kept_.normals) {
    // Two layers each: normals, s
    normals_ =
        withLayersOf(normals_, gl::Texture::makeArray("impostors' normals", GL_RGBA16F, size_,
                                                      size_, 2 * static_cast<int>(count), 0));
    normals_.setFilter(GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR);
  }
  if (kept_.depths)
    depths_ = withLayersOf(depths_, gl::Texture::makeArray("depth maps", GL_R32F, size_, size_,
                                                           static_cast<int>(count)));
}

Images::Missing Images::keep(const std::vector<Impostor>& impostors, std::span<const int> needed) {
  reused_ = 0;
  layerOf_.assign(impostors.size(), -1);
  std::vector<bool> taken(slots_.size(), false);
  Missing missing;
  for (const int index : needed) {
    const Impostor& impostor = impostors[static_cast<std::size_t>(index)];
    const bool lit = isLit(impostor);
    std::size_t s = 0;
    while (s < slots_.size() &&
           (taken[s] || !slots_[s].hasShapeOf(impostor) || (lit && !slots_[s].lit)))
      ++s;
    if (s == slots_.size()) {
      missing.all.push_back(index);
      continue;
    }
    taken[s] = true;
    slots_[s].neededBy = updates_;
    layerOf_[static_cast<std::size_t>(index)] = static_cast<int>(s);
    if (slots_[s].colored && slots_[s].lit == lit && slots_[s].impostor.camera == impostor.camera)
      ++reused_;
    else
      missing.colors.push_back(index);
  }
  return missing;
}

void Images::update(Services& services, const std::vector<Impostor>& impostors,
                    std::span<const int> needed, std::size_t most, bool lit, const Drawn& drawn) {
  drawn_ = reused_ = 0;
  lit_ = lit;
  if (!lit) {
    unlit_.clear();
    for (Slot& slot : slots_)
      if (std::exchange(slot.lit, false)) slot.colored = false;
  }
  ++updates_;
  drawnNow_.assign(impostors.size(), false);
  const Missing missing = keep(impostors, needed);
  // More slots rather than images drawn again, as far as `most` allows
  const auto used = static_cast<std::size_t>(std::ranges::count(slots_, true, &Slot::shaped));
  if (!missing.all.empty())
    grow(std::max(needed.size(), std::min(most, used + missing.all.size())), most);
  std::vector<std::size_t> free;
  for (std::size_t s = 0; s < slots_.size(); ++s)
    if (!slots_[s].shaped || slots_[s].neededBy < updates_) free.push_back(s);
  // Unused slots first, then images that were needed longest ago
  std::ranges::stable_sort(
      free, {}, [&](std::size_t s) { return slots_[s].shaped ? slots_[s].neededBy : 0; });
  for (std::size_t k = 0; k < missing.all.size(); ++k) {
    layerOf_[static_cast<std::size_t>(missing.all[k])] = static_cast<int>(free[k]);
    slots_[free[k]].shaped = false;
  }
  if (missing.all.empty() && missing.colors.empty()) return;
  services.timer.measure("impostors", [&] {
    drawAtRest(services, impostors, missing.all, drawn);
    std::vector<int> toLight;
    for (const auto& [indices, all] : {std::pair(missing.all, true), {missing.colors, false}}) {
      for (const int index : indices) {
        const Impostor& impostor = impostors[static_cast<std::size_t>(index)];
        if (isLit(impostor))
          toLight.push_back(index);
        else
          drawImage(services, impostor, index, all ? &drawn : nullptr);
      }
    }
    lightImages(services, impostors, toLight);
  });
}

void Images::drawAtRest(Services& services, const std::vector<Impostor>& impostors,
                        const std::vector<int>& fresh, const Drawn& drawn) {
  std::map<int, std::vector<int>> byObject;
  for (const int index : fresh) {
    const Impostor& impostor = impostors[static_cast<std::size_t>(index)];
    if (impostor.rest) byObject[impostor.object].push_back(index);
  }
  for (const auto& [object, indices] : byObject) {
    const int changed[] = {object};
    services.raster->update(rest_->geometry(), changed);
    for (const int index : indices) {
      const Impostor& impostor = impostors[static_cast<std::size_t>(index)];
      const bool lit = isLit(impostor);
      drawSurfaces(services, impostor, *impostor.rest,
                   {.radiance = lit, .normal = lit, .factors = lit});
      keepDepths(layerOf(index), drawn);
      if (lit) keepUnlit(layerOf(index), *impostor.rest);
    }
    services.raster->update(services.geometry, changed);
  }
}

void Images::drawImage(Services& services, const Impostor& impostor, int index,
                       const Drawn* drawn) {
  const bool normals = kept_.normals && impostor.reflective;
  drawSurfaces(services, impostor, impostor.camera, {.normal = normals, .specular = normals});
  const int layer = layerOf(index);
  const std::uint64_t clamped = keepColors(layer, normals);
  if (drawn != nullptr && impostor.depth && !impostor.rest) keepDepths(layer, *drawn);
  if (drawn != nullptr && !impostor.depth && *drawn) (*drawn)(layer, {});
  finish(impostor, index, clamped);
}

void Images::finish(const Impostor& impostor, int index, std::uint64_t clampedTexels) {
  const auto layer = static_cast<std::size_t>(layerOf(index));
  if (!isLit(impostor) && layer < unlit_.size()) unlit_[layer] = {};
  slots_[layer] = {.shaped = true,
                   .colored = true,
                   .lit = isLit(impostor),
                   .impostor = impostor,
                   .clampedTexels = clampedTexels,
                   .neededBy = updates_};
  drawnNow_[static_cast<std::size_t>(index)] = true;
  ++drawn_;
}

void Images::keepUnlit(int layer, const Camera& camera) {
  const auto read = [](const gl::Texture& texture) {
    return texture.read<std::uint16_t>(0, GL_RGBA, GL_HALF_FLOAT, 4);
  };
  unlit_.resize(slots_.size());
  unlit_[static_cast<std::size_t>(layer)].set(size_, camera, read(color_), read(normal_),
                                              read(factors_), texels_);
}

void Images::lightImages(Services& services, const std::vector<Impostor>& impostors,
                         const std::vector<int>& indices) {
  std::vector<std::uint64_t> clamped(indices.size());
  parallelFor(indices.size(), 1, [&](std::size_t begin, std::size_t end) {
    static thread_local std::vector<std::uint16_t> texels;
    for (std::size_t k = begin; k < end; ++k) {
      const auto layer = static_cast<std::size_t>(layerOf(indices[k]));
      unlit_[layer].light(impostors[static_cast<std::size_t>(indices[k])].camera, services.lighting,
                          texels);
      clamped[k] = colorsInMemory_[layer].set(size_, texels);
    }
  });
  std::vector<std::uint16_t> texels;
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const int layer = layerOf(indices[k]);
    const HalfImage& image = colorsInMemory_[static_cast<std::size_t>(layer)];
    for (int level = 0; kept_.onDevice && level < colors_.levels(); ++level) {
      image.copy(level, texels);
      colors_.upload(level, layer, GL_RGBA, GL_HALF_FLOAT, texels.data());
    }
    finish(impostors[static_cast<std::size_t>(indices[k])], indices[k], clamped[k]);
  }
}

std::uint64_t Images::clampedTexels() const {
  std::uint64_t sum = 0;
  for (const int layer : layerOf_)
    if (layer >= 0) sum += slots_[static_cast<std::size_t>(layer)].clampedTexels;
  return sum;
}

void Images::drawSurfaces(Services& services, const Impostor& impostor, const Camera& camera,
                          const raster::DiffuseOutputs& outputs) {
  const gl::Framebuffer& target = outputs.factors  ? unlitTarget_
                                  : outputs.normal ? reflectiveTarget_
                                                   : target_;
  const gl::DrawScope scope{gl::DrawState()};
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
    for (int i = 0; i < (outputs.normal ? 3 : 1); ++i) target.clearColor(i, 0.0f, 0.0f, 0.0f, 0.0f);
    services.raster->drawDiffuse(camera.clipFromWorld(), camera.eye, spread, services.lighting,
                                 {.objects = raster::ObjectSet::only({impostor.object + 1}),
                                  .outputs = outputs,
                                  .background = false,
                                  .behind = surface > 0 ? &before_ : nullptr});
  }
}

std::uint64_t Images::keepColors(int layer, bool normals) {
  if (kept_.onDevice) {
    toDevice(color_, colors_, layer);
    if (normals) {
      toDevice(normal_, normals_, 2 * layer);
      toDevice(specular_, normals_, 2 * layer + 1);
    }
  }
  if (!kept_.inMemory) return raster::clampedTexels(color_);
  const auto at = static_cast<std::size_t>(layer);
  if (normals) {
    normalsInMemory_[2 * at].read(normal_);
    normalsInMemory_[2 * at + 1].read(specular_);
  }
  return colorsInMemory_[at].read(color_);
}

void Images::toDevice(gl::Texture& from, const gl::Texture& to, int layer) const {
  from.generateMipmaps();
  for (int level = 0; level < to.levels(); ++level)
    glCopyImageSubData(from.id(), GL_TEXTURE_2D, level, 0, 0, 0, to.id(), GL_TEXTURE_2D_ARRAY,
                       level, 0, 0, layer, to.levelWidth(level), to.levelHeight(level), 1);
}

void Images::keepDepths(int layer, const Drawn& drawn) {
  texels_ = raster::readDepth(depth_);
  if (kept_.onDevice) depths_.upload(0, layer, GL_RED, GL_FLOAT, texels_.data());
  if (drawn) drawn(layer, texels_);
}

}  // namespace catoptric::methods::impostors
