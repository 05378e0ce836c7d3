#include "scene/gltf/container.h"

#include <algorithm>
#include <cstdint>

#include "core/error.h"

namespace catoptric::scene::gltf {
namespace {

/// Deeper nesting than any real file has (glTF itself needs 7; extras may go on); ours.
constexpr int kMaxNesting = 100;

// The words of a GLB file
constexpr std::uint32_t kMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kVersion = 2;
constexpr std::uint32_t kJson = 0x4E4F534A;
constexpr std::uint32_t kBin = 0x004E4942;

std::uint32_t littleEndian32(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value |= std::to_integer<std::uint32_t>(bytes[at + i]) << (8 * i);
  }
  return value;
}

void appendLittleEndian32(std::vector<std::byte>& bytes, std::size_t value) {
  for (std::size_t i = 0; i < 4; ++i) {
    bytes.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFF));
  }
}

void appendChunk(std::vector<std::byte>& bytes, std::uint32_t type, std::span<const std::byte> data,
                 std::byte padding) {
  const std::size_t size = (data.size() + 3) / 4 * 4;
  appendLittleEndian32(bytes, size);
  appendLittleEndian32(bytes, type);
  bytes.insert(bytes.end(), data.begin(), data.end());
  bytes.insert(bytes.end(), size - data.size(), padding);
}

}  // namespace

void fail(const std::string& file, const std::string& place, const std::string& message) {
  throw SceneError(file + ": " + (place.empty() ? "" : place + ": ") + message);
}

Container splitContainer(std::span<const std::byte> bytes, const std::string& file) {
  const auto textOf = [&](std::size_t offset, std::size_t size) {
    return std::string_view(reinterpret_cast<const char*>(bytes.data()) + offset, size);
  };
  if (bytes.size() < 4 || littleEndian32(bytes, 0) != kMagic) {
    if (bytes.size() < 4) fail(file, "", "is empty or too short for a glTF file");
    return {false, textOf(0, bytes.size()), {}};
  }

  if (bytes.size() < 20) fail(file, "byte 0", "GLB header is truncated");
  const std::uint32_t version = littleEndian32(bytes, 4);
  if (version != kVersion) {
    fail(file, "byte 4",
         "GLB version " + std::to_string(version) + " is not supported; version 2 is" +
             (version == 1 ? " (convert it: assimp export IN OUT.glb -fglb2)" : ""));
  }
  const std::size_t length = littleEndian32(bytes, 8);
  if (length > bytes.size()) {
    fail(file, "byte 8",
         "GLB length says " + std::to_string(length) + " bytes, the file has " +
             std::to_string(bytes.size()));
  }

  Container container;
  container.binary = true;
  std::size_t at = 12;
  for (int chunk = 0; at < length; ++chunk) {
    if (length - at < 8) fail(file, "byte " + std::to_string(at), "GLB chunk header is truncated");
    const std::size_t size = littleEndian32(bytes, at);
    const std::uint32_t type = littleEndian32(bytes, at + 4);
    if (size > length - at - 8) {
      fail(file, "byte " + std::to_string(at),
           "GLB chunk of " + std::to_string(size) + " bytes reaches past the end of the file");
    }
    if (size % 4 != 0) {
      fail(file, "byte " + std::to_string(at),
           "GLB chunk length " + std::to_string(size) + " is not a multiple of 4");
    }
    if (chunk == 0) {
      if (type != kJson) fail(file, "byte " + std::to_string(at), "first GLB chunk is not JSON");
      container.json = textOf(at + 8, size);
      // Chunks are padded with spaces; some programs pad with zeros.
      while (container.json.ends_with('\0')) container.json.remove_suffix(1);
    } else if (chunk == 1 && type == kBin) {
      container.bin = bytes.subspan(at + 8, size);
    }
    at += 8 + size;
  }
  if (container.json.empty()) fail(file, "byte 12", "GLB file has no JSON");
  return container;
}

std::vector<std::byte> rewritten(const Container& container, std::span<const Rewrite> rewrites) {
  std::string json;
  json.reserve(container.json.size());
  std::size_t done = 0;
  for (const Rewrite& rewrite : rewrites) {
    json += container.json.substr(done, rewrite.begin - done);
    json += rewrite.text;
    done = rewrite.end;
  }
  json += container.json.substr(done);

  const auto text = std::as_bytes(std::span(json));
  if (!container.binary) return {text.begin(), text.end()};
  std::vector<std::byte> bytes;
  bytes.reserve(json.size() + container.bin.size() + 32);
  appendLittleEndian32(bytes, kMagic);
  appendLittleEndian32(bytes, kVersion);
  appendLittleEndian32(bytes, 0);
  appendChunk(bytes, kJson, text, std::byte{' '});
  if (!container.bin.empty()) appendChunk(bytes, kBin, container.bin, std::byte{0});
  std::vector<std::byte> length;
  appendLittleEndian32(length, bytes.size());
  std::copy(length.begin(), length.end(), bytes.begin() + 8);
  return bytes;
}

void checkNesting(std::string_view json, const std::string& file) {
  int depth = 0;
  bool inString = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (inString) {
      if (c == '\\') ++i;
      if (c == '"') inString = false;
    } else if (c == '"') {
      inString = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxNesting) {
        fail(file, "byte " + std::to_string(i),
             "JSON nested deeper than the " + std::to_string(kMaxNesting) + " levels allowed");
      }
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

}  // namespace catoptric::scene::gltf
