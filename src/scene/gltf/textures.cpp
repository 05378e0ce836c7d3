#include "scene/gltf/textures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "scene/finish.h"
#include "scene/gltf/check.h"
#include "scene/gltf/rules.h"
#include "scene/texture.h"

namespace catoptric::scene::gltf {
namespace {

constexpr int kBoard = 512;  ///< texels along the edge of a missing image's stand-in
/// Squares along its edge, and how much lighter the light ones are.
constexpr std::array<std::array<int, 2>, 3> kBoardSquares{{{2, 60}, {16, 135}, {128, 60}}};
constexpr std::uint8_t kFlat = 128;  ///< X and Y of a normal that is the surface's own

Wrap wrapOf(int code) {
  switch (code) {
    case TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE:
      return Wrap::ClampToEdge;
    case TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT:
      return Wrap::MirroredRepeat;
    default:
      return Wrap::Repeat;
  }
}

/// uv' = translation * rotation * scale * uv; counter-clockwise seen with v pointing up, as the
/// extension's example needs it.
glm::mat3x2 textureTransform(const tinygltf::Value& transform) {
  const auto pair = [&](const char* key, float otherwise) {
    const tinygltf::Value& value = member(transform, key);
    if (!value.IsArray() || value.ArrayLen() != 2) return Vec2(otherwise);
    return Vec2(static_cast<float>(value.Get(0).GetNumberAsDouble()),
                static_cast<float>(value.Get(1).GetNumberAsDouble()));
  };
  const Vec2 offset = pair("offset", 0.0f);
  const Vec2 scale = pair("scale", 1.0f);
  const double angle = numberOr(transform, "rotation", 0.0);
  const auto c = static_cast<float>(std::cos(angle));
  const auto s = static_cast<float>(std::sin(angle));
  return {c * scale.x, -s * scale.x, s * scale.y, c * scale.y, offset.x, offset.y};
}

}  // namespace

TextureSlot Textures::slot(int index, int texCoord, const tinygltf::ExtensionMap& extensions,
                           bool srgb, const std::string& place) {
  TextureSlot result;
  if (index < 0) return result;
  const tinygltf::Texture& source = reader_.model.textures[static_cast<std::size_t>(index)];
  const std::string self = elementPlace("textures", static_cast<std::size_t>(index));
  Key key;
  key.image = source.source;
  for (const auto& [name, other] : source.extensions) {
    if (key.image >= 0 || !isImageExtension(name)) continue;
    key.image = static_cast<int>(numberOr(other, "source", kNone));
    unreadable_.try_emplace(key.image, name);
  }
  if (key.image < 0) {
    reader_.scene.notes.push_back(place + ": " + self + " is ignored, because it has no image");
    return result;
  }
  key.srgb = srgb;
  if (source.sampler >= 0) {
    const tinygltf::Sampler& sampler =
        reader_.model.samplers[static_cast<std::size_t>(source.sampler)];
    key.wrapS = wrapOf(sampler.wrapS);
    key.wrapT = wrapOf(sampler.wrapT);
    key.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST ||
                  (sampler.magFilter < 0 && sampler.minFilter == TINYGLTF_TEXTURE_FILTER_NEAREST);
  }
  const auto [found, isNew] =
      textures_.try_emplace(key, static_cast<int>(reader_.scene.textures.size()));
  if (isNew) {
    const tinygltf::Image& image = reader_.model.images[static_cast<std::size_t>(key.image)];
    Texture texture;
    texture.name = !source.name.empty()  ? source.name
                   : !image.name.empty() ? image.name
                   : !image.uri.empty()  ? image.uri
                                         : "image " + std::to_string(key.image);
    texture.srgb = key.srgb;
    texture.nearest = key.nearest;
    texture.wrapS = key.wrapS;
    texture.wrapT = key.wrapT;
    reader_.scene.textures.push_back(std::move(texture));
    keys_.push_back(key);
  }
  result.texture = found->second;

  const tinygltf::Value& transform = extension(extensions, "KHR_texture_transform");
  result.uvSet = static_cast<int>(numberOr(transform, "texCoord", texCoord));
  if (result.uvSet > 1) {
    reader_.fail(place, "texture coordinate set " + std::to_string(result.uvSet) +
                            " is not supported: 0 and 1 are");
  }
  if (transform.IsObject()) result.transform = textureTransform(transform);
  return result;
}

TextureSlot Textures::slot(const tinygltf::Value& extension, const char* key,
                           const std::string& place) {
  const tinygltf::Value& info = member(extension, key);
  const tinygltf::ExtensionMap transform = {
      {"KHR_texture_transform", member(member(info, "extensions"), "KHR_texture_transform")}};
  return slot(static_cast<int>(numberOr(info, "index", -1.0)),
              static_cast<int>(numberOr(info, "texCoord", 0.0)), transform, false,
              place + "/" + key);
}

std::optional<image::Image8> Textures::readImage(int index) const {
  const tinygltf::Image& source = reader_.model.images[static_cast<std::size_t>(index)];
  const std::string place = elementPlace("images", static_cast<std::size_t>(index));
  std::vector<std::byte> file;
  std::span<const std::byte> bytes;
  std::string name = reader_.file + ": " + place;
  const std::string instead =
      " (to render it with a checkerboard instead: --set missing_textures=show)";
  if (const auto found = unreadable_.find(index); found != unreadable_.end()) {
    if (reader_.limits.showMissingTextures) return std::nullopt;
    reader_.fail(place, "is an image of " + found->second +
                            ", which is not supported; PNG and JPEG are" + instead);
  }
  if (source.bufferView >= 0) {
    bytes = std::as_bytes(reader_.bytesOf(source.bufferView, place));
  } else if (!source.image.empty()) {
    bytes = std::as_bytes(std::span(source.image));
  } else {
    const std::filesystem::path path =
        fileOfUri(source.uri, reader_.file, reader_.limits, place + "/uri");
    try {
      file = readFile(path, reader_.limits.maxFileBytes);
    } catch (const Error& e) {
      if (reader_.limits.showMissingTextures) return std::nullopt;
      reader_.fail(place + "/uri", e.what() + std::string(kAssetHint) + instead);
    }
    bytes = file;
    name += " (" + path.string() + ")";
  }
  return image::decodeImage8(bytes, name, reader_.limits.maxTexturePixels);
}

std::string Textures::whyMissing(int image) const {
  const auto found = unreadable_.find(image);
  if (found != unreadable_.end()) return "an image of " + found->second + " is not supported";
  return gltf::quoted(reader_.model.images[static_cast<std::size_t>(image)].uri) + " is missing";
}

image::Image8 Textures::standIn(std::size_t texture) const {
  const auto of = [&](const TextureSlot& slot) {
    return slot.texture == static_cast<int>(texture);
  };
  if (!reader_.scene.textures[texture].srgb) {
    const bool normals = std::ranges::any_of(
        reader_.scene.materials, [&](const Material& m) { return of(m.normalTexture); });
    return {1, 1, {normals ? kFlat : kWhite, normals ? kFlat : kWhite, kWhite, kWhite}};
  }
  image::Image8 board{kBoard, kBoard, {}};
  board.rgba.reserve(std::size_t{4} * kBoard * kBoard);
  for (int i = 0; i < kBoard * kBoard; ++i) {
    int light = 0;
    for (const auto& [squares, weight] : kBoardSquares) {
      const int texels = kBoard / squares;
      if ((i % kBoard / texels + i / kBoard / texels) % 2 == 0) light += weight;
    }
    const auto magenta = static_cast<std::uint8_t>(light);
    board.rgba.insert(board.rgba.end(), {magenta, 0, magenta, kWhite});
  }
  return board;
}

void Textures::decode() {
  struct Job {
    int image = kNone;
    std::vector<std::size_t> textures;
    std::exception_ptr error;
    bool missing = false;
  };
  std::vector<Job> jobs;
  for (std::size_t t = 0; t < keys_.size(); ++t) {
    auto job = std::find_if(jobs.begin(), jobs.end(),
                            [&](const Job& j) { return j.image == keys_[t].image; });
    if (job == jobs.end()) job = jobs.insert(jobs.end(), Job{keys_[t].image, {}, nullptr});
    job->textures.push_back(t);
  }
  parallelFor(jobs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      try {
        jobs[i].missing = !decodeImage(jobs[i].image, jobs[i].textures);
      } catch (...) {
        jobs[i].error = std::current_exception();
      }
    }
  });
  for (const Job& job : jobs) {
    if (job.error) std::rethrow_exception(job.error);
    if (job.missing)
      reader_.scene.warnings.push_back(
          reader_.file + ": " + elementPlace("images", static_cast<std::size_t>(job.image)) + ": " +
          whyMissing(job.image) + ": its colours show a checkerboard");
  }
}

bool Textures::decodeImage(int imageIndex, const std::vector<std::size_t>& uses) {
  std::optional<image::Image8> decoded = readImage(imageIndex);
  if (!decoded) {
    for (const std::size_t t : uses) {
      const image::Image8 board = standIn(t);
      reader_.reserveBytes(mipChainBytes(board.width, board.height),
                           elementPlace("images", static_cast<std::size_t>(imageIndex)));
      Texture& texture = reader_.scene.textures[t];
      texture.levels = makeMipChain(board.width, board.height, board.rgba, texture.srgb);
    }
    return false;
  }
  image::Image8& image = *decoded;
  reader_.reserveBytes(uses.size() * mipChainBytes(image.width, image.height),
                       elementPlace("images", static_cast<std::size_t>(imageIndex)));
  for (std::size_t u = 0; u < uses.size(); ++u) {
    Texture& texture = reader_.scene.textures[uses[u]];
    const auto same = std::find_if(
        uses.begin(), uses.begin() + static_cast<std::ptrdiff_t>(u),
        [&](std::size_t other) { return reader_.scene.textures[other].srgb == texture.srgb; });
    if (same != uses.begin() + static_cast<std::ptrdiff_t>(u)) {
      texture.levels = reader_.scene.textures[*same].levels;
      continue;
    }
    std::vector<std::uint8_t> rgba =
        u + 1 == uses.size() ? std::move(image.rgba) : std::vector<std::uint8_t>(image.rgba);
    texture.levels = makeMipChain(image.width, image.height, std::move(rgba), texture.srgb);
  }
  return true;
}

}  // namespace catoptric::scene::gltf
