// The images of impostors on the GPU. They are drawn when needed, and kept while valid.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "gl/objects.h"
#include "methods/contract/method.h"
#include "methods/shared/impostors/choice.h"
#include "methods/shared/impostors/half_image.h"

namespace catoptric::methods::impostors {

class Images {
 public:
  /// `normals`: reflective impostors have normals, too; `depths`: depth maps are kept on the
  /// device.
  struct Kept {
    bool normals = false;
    bool depths = false;
    bool inMemory = false;
    bool onDevice = true;
  };
  void prepare(int textureSize, const Kept& kept);

  /// Marks the images of these objects as outdated. forgetAll(): after changes of lights.
  void forget(std::span<const int> objects);
  void forgetAll();
  /// Marks the images as outdated that none of `impostors` has.
  void retain(const std::vector<Impostor>& impostors);
  /// Drops all images if there are more than `most`.
  void limit(std::size_t most);

  /// Bytes of one image with its mip levels.
  static std::uint64_t bytesOf(int textureSize, const Kept& kept, bool reflective);

  /// Draws the images of `needed` (indices of `impostors`) that are outdated, as step `impostors`.
  /// Other images are kept as long as there are at most `most` images in all. layerOf() is valid
  /// until the next call. `drawn(impostor, layer, depth texels)` is called for each image that was
  /// drawn; the texels are empty unless it is a depth map.
  using Drawn = std::function<void(int, int, std::span<const float>)>;
  void update(Services& services, const std::vector<Impostor>& impostors,
              std::span<const int> needed, std::size_t most, const Drawn& drawn);

  /// The layer of an impostor's image; -1: not needed in this frame.
  int layerOf(int impostor) const { return layerOf_[static_cast<std::size_t>(impostor)]; }
  bool drawnNow(int impostor) const { return drawnNow_[static_cast<std::size_t>(impostor)]; }
  std::size_t layers() const { return slots_.size(); }
  /// Layers with a depth map, outdated ones included.
  std::size_t maps() const {
    return static_cast<std::size_t>(std::ranges::count(slots_, true, &Slot::depth));
  }
  std::uint64_t drawnCount() const { return drawn_; }
  std::uint64_t reusedCount() const { return reused_; }
  /// Number of clamped texels in the needed images, whenever they were drawn.
  std::uint64_t clampedTexels() const;

  const gl::Texture& colors() const { return colors_; }
  const gl::Texture& normals() const { return normals_; }
  const gl::Texture& depths() const { return depths_; }
  /// Indexed by layer. normalsInMemory() has two images per layer: the normals, then s.
  const std::vector<HalfImage>& colorsInMemory() const { return colorsInMemory_; }
  const std::vector<HalfImage>& normalsInMemory() const { return normalsInMemory_; }

 private:
  struct Slot {
    bool used = false;
    bool slab = false;
    bool depth = false;
    int object = 0;
    int peeled = 0;
    Camera camera;
    std::uint64_t clampedTexels = 0;
    std::uint64_t neededBy = 0;  ///< number of the last update() that needed the image
    bool shows(const Impostor& impostor) const;
  };
  /// Whether it made more slots; where images are on the device, all are then lost.
  bool grow(std::size_t layers, std::size_t most);
  /// Sets layerOf() of the images that are there. Returns those of `needed` that are not.
  std::vector<int> keep(const std::vector<Impostor>& impostors, std::span<const int> needed);
  /// Returns the number of clamped texels.
  std::uint64_t draw(Services& services, const Impostor& impostor, int layer, const Drawn& drawn,
                     int index);

  int size_ = 0;
  Kept kept_;
  std::vector<Slot> slots_;
  std::uint64_t updates_ = 0;
  std::vector<int> layerOf_;
  std::vector<bool> drawnNow_;
  std::uint64_t drawn_ = 0;
  std::uint64_t reused_ = 0;
  gl::Texture colors_;   ///< RGBA16F, all levels: radiance times coverage, coverage
  gl::Texture normals_;  ///< RGBA16F, all levels: normal, s, both times coverage
  gl::Texture depths_;   ///< R32F: g of Camera::rows(), 0 on the background
  gl::Texture color_;    ///< render target
  gl::Texture normal_;
  gl::Texture specular_;
  gl::Texture depth_;
  gl::Texture before_;  ///< depths of the surface that was peeled last
  gl::Framebuffer target_;
  gl::Framebuffer reflectiveTarget_;
  std::vector<float> texels_;
  std::vector<HalfImage> colorsInMemory_;
  std::vector<HalfImage> normalsInMemory_;
};

}  // namespace catoptric::methods::impostors
