#include "scene/gltf/uris.h"

#include <array>
#include <cstdint>

#include "core/text.h"
#include "scene/gltf/compressed.h"
#include "scene/gltf/rules.h"

namespace catoptric::scene::gltf {
namespace {

using config::Value;

/// The name under which tinygltf 2.7.0 asks for a URI: it turns '+' into a space, and decodes
/// what is no hexadecimal number to anything. Names only need to be found again.
std::string parserName(const std::string& uri) {
  const auto digit = [](char c) {
    // tinygltf's from_hex
    if (c <= '9' && c >= '0') return static_cast<unsigned char>(c - '0');
    if (c <= 'f' && c >= 'a') return static_cast<unsigned char>(c - 'a' + 10);
    if (c <= 'F' && c >= 'A') return static_cast<unsigned char>(c - 'A' + 10);
    return static_cast<unsigned char>(0);
  };
  std::string result;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '+') {
      result += ' ';
    } else if (uri[i] == '%' && uri.size() > i + 2) {
      result += static_cast<char>((digit(uri[i + 1]) << 4) | digit(uri[i + 2]));
      i += 2;
    } else {
      result += uri[i];
    }
  }
  return result;
}

bool isDataUri(std::string_view uri) {
  return uri.rfind("data:", 0) == 0;
}

void checkBufferUris(const Value& root, const Container& container, const std::string& file,
                     const LoadLimits& limits, External& external) {
  const Value buffers = root.get("buffers");
  for (std::size_t i = 0; !buffers.isNull() && i < buffers.asArray().size(); ++i) {
    const Value& buffer = buffers.asArray()[i];
    const std::string place = "/buffers/" + std::to_string(i);
    const auto length = static_cast<std::size_t>(buffer.get("byteLength").asNumber());
    if (length > limits.maxFileBytes) {
      fail(file, place + "/byteLength",
           std::to_string(length) + " bytes, more than the " + std::to_string(limits.maxFileBytes) +
               " allowed");
    }
    if (isEmptyFallback(buffer)) continue;
    if (!buffer.has("uri")) {
      if (!container.binary || i != 0) {
        fail(file, place, "has no uri (only the first buffer of a .glb file may do without)");
      }
      if (length > container.bin.size()) {
        fail(file, place + "/byteLength",
             std::to_string(length) + " bytes, but the BIN chunk has " +
                 std::to_string(container.bin.size()));
      }
      continue;
    }
    const std::string& uri = buffer.get("uri").asString();
    if (isDataUri(uri)) {
      const std::size_t have = decodeDataUri(uri, file, place + "/uri").size();
      if (have != length) {
        fail(file, place,
             "byteLength is " + std::to_string(length) + ", but the data URI has " +
                 std::to_string(have) + " bytes");
      }
    } else {
      fileOfUri(uri, file, limits, place + "/uri");
    }
    // The same file as two buffers of different length: the parser asks by name only.
    const auto [entry, isNew] = external.byParserName.try_emplace(
        parserName(uri), External::Entry{uri, place + "/uri", true, length});
    if (!isNew && !isDataUri(uri) && entry->second.byteLength != length) {
      fail(file, place + "/byteLength",
           "two buffers with the uri " + quoted(uri) + " differ in byteLength");
    }
  }
}

void checkImageUris(const Value& root, const std::string& file, const LoadLimits& limits,
                    External& external) {
  const Value images = root.get("images");
  for (std::size_t i = 0; !images.isNull() && i < images.asArray().size(); ++i) {
    const Value& image = images.asArray()[i];
    const std::string place = "/images/" + std::to_string(i);
    if (image.has("uri") == image.has("bufferView")) {
      fail(file, place,
           image.has("uri") ? "has both a uri and a bufferView"
                            : "has neither a uri nor a bufferView");
    }
    if (!image.has("uri")) continue;
    const std::string& uri = image.get("uri").asString();
    if (!isDataUri(uri)) {
      fileOfUri(uri, file, limits, place + "/uri");
    } else if (decodeDataUri(uri, file, place + "/uri").empty()) {
      fail(file, place + "/uri", "holds no data");
    }
    external.byParserName.try_emplace(parserName(uri),
                                      External::Entry{uri, place + "/uri", false, 0});
  }
}

}  // namespace

External checkUris(const Value& root, const Container& container, const std::string& file,
                   const LoadLimits& limits) {
  External external;
  checkBufferUris(root, container, file, limits, external);
  checkImageUris(root, file, limits, external);
  return external;
}

std::filesystem::path fileOfUri(const std::string& uri, const std::string& file,
                                const LoadLimits& limits, const std::string& place) {
  if (uri.empty()) fail(file, place, "is empty");
  std::string decoded;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%') {
      decoded += uri[i];
      continue;
    }
    const int high = i + 2 < uri.size() ? hexDigit(uri[i + 1]) : -1;
    const int low = i + 2 < uri.size() ? hexDigit(uri[i + 2]) : -1;
    if (high < 0 || low < 0) fail(file, place, quoted(uri) + ": bad percent encoding");
    decoded += static_cast<char>(high * 16 + low);
    i += 2;
  }
  if (decoded.find('\0') != std::string::npos) fail(file, place, "contains a zero byte");
  const std::size_t colon = decoded.find(':');
  if (colon != std::string::npos && decoded.find('/') > colon) {
    fail(file, place, quoted(uri) + ": only relative paths and data: URIs are supported");
  }
  std::filesystem::path path =
      assetFile(std::filesystem::path(file).parent_path(), decoded, limits);
  if (path.empty()) {
    fail(file, place,
         quoted(uri) +
             " is outside the folder of this file; copy it there, or name its folder by "
             "--asset-path");
  }
  return path;
}

std::string decodeDataUri(std::string_view uri, const std::string& file, const std::string& place) {
  const std::size_t comma = uri.find(',');
  constexpr std::string_view kBase64 = ";base64";
  if (!isDataUri(uri) || comma == std::string_view::npos ||
      uri.substr(0, comma).size() < kBase64.size() ||
      uri.substr(comma - kBase64.size(), kBase64.size()) != kBase64) {
    fail(file, place, "data URIs must be data:TYPE;base64,...");
  }
  std::string_view body = uri.substr(comma + 1);
  while (!body.empty() && body.back() == '=') body.remove_suffix(1);
  if (body.size() % 4 == 1) fail(file, place, "base64 data is truncated");

  std::array<int, 256> digit{};
  digit.fill(-1);
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < kDigits.size(); ++i) {
    digit[static_cast<unsigned char>(kDigits[i])] = static_cast<int>(i);
  }
  std::string result;
  result.reserve(body.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int count = 0;
  for (std::size_t i = 0; i < body.size(); ++i) {
    const int d = digit[static_cast<unsigned char>(body[i])];
    if (d < 0) {
      fail(file, place, "base64 data has an invalid character at byte " + std::to_string(i));
    }
    bits = (bits << 6) | static_cast<std::uint32_t>(d);
    if (++count == 4) {
      result += static_cast<char>(bits >> 16);
      result += static_cast<char>((bits >> 8) & 0xFF);
      result += static_cast<char>(bits & 0xFF);
      bits = 0;
      count = 0;
    }
  }
  if (count == 2) result += static_cast<char>((bits >> 4) & 0xFF);
  if (count == 3) {
    result += static_cast<char>((bits >> 10) & 0xFF);
    result += static_cast<char>((bits >> 2) & 0xFF);
  }
  return result;
}

}  // namespace catoptric::scene::gltf
