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
#include "methods/shared/impostors/unlit_image.h"

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
  /// `rest`: null unless impostors have Impostor::rest.
  void prepare(int textureSize, const Kept& kept, const RestPose* rest = nullptr);

  /// Marks the images of these objects as outdated, except depths in the rest pose.
  void forget(std::span<const int> objects);
  void forgetAll();
  /// After changes of lights: depths stay.
  void forgetColors();
  /// Marks the images as outdated that none of `impostors` has.
  void retain(const std::vector<Impostor>& impostors);
  /// Drops all images if there are more than `most`.
  void limit(std::size_t most);

  /// Whether colours of an object that moves rigidly are not drawn: the CPU adds light to an unlit
  /// image.
  static bool isLit(const Impostor& impostor, const Kept& kept) {
    return impostor.depth && impostor.moves && !impostor.deforms && kept.inMemory &&
           !(kept.normals && impostor.reflective);
  }

  /// Bytes of one image with its mip levels.
  static std::uint64_t bytesOf(int textureSize, const Kept& kept, bool reflective);

  /// Draws the images of `needed` (indices of `impostors`) that are outdated, as step `impostors`.
  /// `lit`: there is memory for unlit images.
  /// Other images are kept as long as there are at most `most` images in all. layerOf() is valid
  /// until the next call. `drawn(layer, depth texels)` is called for each layer that shows
  /// something else than before, colours apart; the texels are empty unless it is a depth map.
  using Drawn = std::function<void(int, std::span<const float>)>;
  void update(Services& services, const std::vector<Impostor>& impostors,
              std::span<const int> needed, std::size_t most, bool lit, const Drawn& drawn);

  /// The layer of an impostor's image; -1: not needed in this frame.
  int layerOf(int impostor) const { return layerOf_[static_cast<std::size_t>(impostor)]; }
  bool drawnNow(int impostor) const { return drawnNow_[static_cast<std::size_t>(impostor)]; }
  std::size_t layers() const { return slots_.size(); }
  /// Layers with a depth map, outdated ones included.
  std::size_t maps() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(slots_, [](const Slot& slot) { return slot.impostor.depth; }));
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
    bool shaped = false;   ///< it shows `impostor`; its depths are valid
    bool colored = false;  ///< so are its colours and normals
    bool lit = false;      ///< it has an unlit image, to which the colours are due
    Impostor impostor = {};
    std::uint64_t clampedTexels = 0;
    std::uint64_t neededBy = 0;  ///< number of the last update() that needed the image
    /// Whether the depths are those of an impostor; of a quad, whether it is that one.
    bool hasShapeOf(const Impostor& other) const;
  };
  /// Images to draw, as indices of impostors.
  struct Missing {
    std::vector<int> all;     ///< layerOf() is not set
    std::vector<int> colors;  ///< layerOf() has the depths
  };
  /// Makes more slots, if there are fewer than `layers`.
  void grow(std::size_t layers, std::size_t most);
  /// Sets layerOf() of the images that are there. Returns those of `needed` that are not.
  Missing keep(const std::vector<Impostor>& impostors, std::span<const int> needed);
  /// Draws the depths of those of `fresh` that have a rest pose.
  void drawAtRest(Services& services, const std::vector<Impostor>& impostors,
                  const std::vector<int>& fresh, const Drawn& drawn);
  /// Draws an impostor's colours; with `drawn` also the depths that are not drawn at rest.
  void drawImage(Services& services, const Impostor& impostor, int index, const Drawn* drawn);
  void drawSurfaces(Services& services, const Impostor& impostor, const Camera& camera,
                    const raster::DiffuseOutputs& outputs);
  void keepDepths(int layer, const Drawn& drawn);
  /// Returns the number of clamped texels.
  std::uint64_t keepColors(int layer, bool normals);
  void toDevice(gl::Texture& from, const gl::Texture& to, int layer) const;
  bool isLit(const Impostor& impostor) const {
    return lit_ && impostor.rest && isLit(impostor, kept_);
  }
  void keepUnlit(int layer, const Camera& camera);
  void lightImages(Services& services, const std::vector<Impostor>& impostors,
                   const std::vector<int>& indices);
  void finish(const Impostor& impostor, int index, std::uint64_t clampedTexels);

  int size_ = 0;
  Kept kept_;
  const RestPose* rest_ = nullptr;
  bool lit_ = false;  ///< whether this frame has unlit images
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
  gl::Texture factors_;
  gl::Texture depth_;
  gl::Texture before_;  ///< depths of the surface that was peeled last
  gl::Framebuffer target_;
  gl::Framebuffer reflectiveTarget_;
  gl::Framebuffer unlitTarget_;
  std::vector<float> texels_;
  std::vector<HalfImage> colorsInMemory_;
  std::vector<HalfImage> normalsInMemory_;
  std::vector<UnlitImage> unlit_;  ///< by layer
};

}  // namespace catoptric::methods::impostors
