// Textures of a glTF file: references to them, and their images.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "image/image.h"
#include "scene/gltf/reader.h"

namespace catoptric::scene::gltf {

inline constexpr std::uint8_t kWhite = 255;  ///< data that leave a factor as it is

/// The textures that materials refer to. Each is read once for each use, as colour or as data.
class Textures {
 public:
  explicit Textures(Reader& reader) : reader_(reader) {}

  /// A reference to a texture; `srgb` says how its texels are meant. The texture gets its texels
  /// from decode().
  TextureSlot slot(int index, int texCoord, const tinygltf::ExtensionMap& extensions, bool srgb,
                   const std::string& place);
  /// The texture, of data, that a member of an extension refers to.
  TextureSlot slot(const tinygltf::Value& extension, const char* key, const std::string& place);

  /// Decodes each image once, and makes its mip chain once for colour and once for data. Images
  /// that are missing get stand-ins under LoadLimits::showMissingTextures, with warnings.
  void decode();

 private:
  /// A texture as the scene needs it: one image may serve as colour and as data, and with several
  /// samplers.
  struct Key {
    int image = kNone;
    bool srgb = true;
    bool nearest = false;
    Wrap wrapS = Wrap::Repeat;
    Wrap wrapT = Wrap::Repeat;
    auto operator<=>(const Key&) const = default;  // NOLINT(modernize-use-nullptr)
  };

  /// Null: its file cannot be read, and LoadLimits::showMissingTextures is set.
  std::optional<image::Image8> readImage(int index) const;
  std::string whyMissing(int image) const;
  /// What is drawn for a missing image: colours show a checkerboard, data change nothing. Squares
  /// of three sizes, so that some are seen however often a model repeats the image.
  image::Image8 standIn(std::size_t texture) const;
  /// False: the image is missing, and its textures have stand-ins.
  bool decodeImage(int imageIndex, const std::vector<std::size_t>& uses);

  Reader& reader_;
  std::map<Key, int> textures_;
  std::vector<Key> keys_;                  ///< of scene.textures
  std::map<int, std::string> unreadable_;  ///< images of a kind that some extension adds
};

}  // namespace catoptric::scene::gltf
