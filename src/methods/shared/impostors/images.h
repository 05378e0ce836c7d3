// The images of impostors on the device: drawn when first needed, kept while what they show does
// not change.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "gl/objects.h"
#include "methods/contract/method.h"
#include "methods/shared/impostors/choice.h"
#include "methods/shared/impostors/half_image.h"

namespace catoptric::methods::impostors {

class Images {
 public:
  /// `reflective`: with images of normals; `depths`: depth maps are kept, and handed to whoever
  /// asks; `inMemory`, `onDevice`: where images are kept.
  void prepare(int textureSize, bool reflective, bool depths, bool inMemory, bool onDevice);

  /// What was drawn from here on differs in these objects, or with other lights in all.
  void forget(std::span<const int> objects);
  void forgetAll();

  /// Makes all of `needed` (indices of `impostors`) ready, as step `impostors`; layerOf() holds
  /// until the next call. `drawn(impostor, layer, depth texels)` is called for each depth map.
  using Drawn = std::function<void(int, int, std::span<const float>)>;
  void update(Services& services, const std::vector<Impostor>& impostors,
              std::span<const int> needed, const Drawn& drawn);

  /// -1: not needed in this frame.
  int layerOf(int impostor) const { return layerOf_[static_cast<std::size_t>(impostor)]; }
  bool drawnNow(int impostor) const { return drawnNow_[static_cast<std::size_t>(impostor)]; }
  int layers() const { return static_cast<int>(slots_.size()); }
  std::uint64_t drawnCount() const { return drawn_; }
  std::uint64_t keptCount() const { return kept_; }
  /// Texels of the needed images that half floats have clamped, whenever they were drawn.
  std::uint64_t clampedTexels() const;

  const gl::Texture& colors() const { return colors_; }
  const gl::Texture& normals() const { return normals_; }
  const gl::Texture& depths() const { return depths_; }
  /// By layer; of normals two each: normals, s.
  const std::vector<HalfImage>& colorsInMemory() const { return colorsInMemory_; }
  const std::vector<HalfImage>& normalsInMemory() const { return normalsInMemory_; }

 private:
  struct Slot {
    bool used = false;
    bool slab = false;
    int object = 0;
    int peeled = 0;
    Camera camera;
    std::uint64_t clampedTexels = 0;
  };
  void grow(std::size_t layers);
  /// Returns how many of its texels half floats have clamped.
  std::uint64_t draw(Services& services, const Impostor& impostor, int layer, const Drawn& drawn,
                     int index);

  int size_ = 0;
  bool reflective_ = false;
  bool keepsDepths_ = false;
  bool inMemory_ = false;
  bool onDevice_ = true;
  std::vector<Slot> slots_;
  std::vector<int> layerOf_;
  std::vector<bool> drawnNow_;
  std::uint64_t drawn_ = 0;
  std::uint64_t kept_ = 0;
  gl::Texture colors_;   ///< RGBA16F, all levels: radiance times coverage, coverage
  gl::Texture normals_;  ///< RGBA16F, all levels: normal, s, both times coverage
  gl::Texture depths_;   ///< R32F: Camera::rows()'s g, 0 where nothing is
  gl::Texture color_;    ///< what is drawn into
  gl::Texture normal_;
  gl::Texture specular_;
  gl::Texture depth_;
  gl::Texture before_;  ///< depths of the surface that was peeled off last
  gl::Framebuffer target_;
  gl::Framebuffer reflectiveTarget_;
  std::vector<float> texels_;
  std::vector<HalfImage> colorsInMemory_;
  std::vector<HalfImage> normalsInMemory_;
};

}  // namespace catoptric::methods::impostors
