#include "report/layer_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "core/error.h"
#include "core/text.h"

namespace catoptric::report {
namespace {

using image::Image;

constexpr Colour kNotFinite = {255, 0, 255};
constexpr std::array kColourParts = {".R", ".G", ".B"};
constexpr std::array kVectorParts = {".X", ".Y", ".Z"};

/// Channels of a layer of three; none where it is not.
std::vector<int> threeOf(const Image& frame, const std::string& layer,
                         const std::array<const char*, 3>& parts) {
  std::vector<int> channels;
  for (const char* part : parts) {
    const int channel = frame.channel(layer + part);
    if (channel < 0) return {};
    channels.push_back(channel);
  }
  return channels;
}

std::uint8_t step(float unit) {
  return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(unit, 0.0f, 1.0f)));
}

/// A picture by `colourOf` the values of `channels`.
Rgb8 picture(const Image& frame, const std::vector<int>& channels,
             const std::function<Colour(const std::array<float, 3>&)>& colourOf) {
  Rgb8 result{frame.width, frame.height, {}};
  result.rgb.reserve(3 * frame.pixelCount());
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      std::array<float, 3> values{};
      bool finite = true;
      for (std::size_t c = 0; c < channels.size(); ++c) {
        values[c] = frame.at(x, y, channels[c]);
        finite = finite && std::isfinite(values[c]);
      }
      const Colour colour = finite ? colourOf(values) : kNotFinite;
      result.rgb.insert(result.rgb.end(), colour.begin(), colour.end());
    }
  }
  return result;
}

Rgb8 colours(const Image& frame, const std::vector<int>& channels) {
  Image shown{frame.width, frame.height, {"R", "G", "B"}, {}};
  shown.data.reserve(3 * frame.pixelCount());
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      for (const int channel : channels) shown.data.push_back(frame.at(x, y, channel));
    }
  }
  return {frame.width, frame.height, image::displayRgb8(shown)};
}

}  // namespace

std::vector<std::string> layerNames(const Image& frame) {
  std::vector<std::string> names;
  for (const std::string& channel : frame.channels) {
    if (channel == "R" || channel == "G" || channel == "B" || channel == "A") continue;
    std::string name = channel;
    const std::string parent = channel.substr(0, channel.rfind('.'));
    if (parent != channel && (!threeOf(frame, parent, kColourParts).empty() ||
                              !threeOf(frame, parent, kVectorParts).empty()))
      name = parent;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

std::vector<std::string> layersNamed(const Image& frame, const std::string& name,
                                     const std::string& file) {
  const std::vector<std::string> names = layerNames(frame);
  std::vector<std::string> found;
  for (const std::string& layer : names) {
    if (layer == name || layer == "id." + name || layer.starts_with(name + "."))
      found.push_back(layer);
  }
  if (found.empty()) {
    throw UsageError(file + ": it has no layer \"" + name + "\"" + didYouMean(name, names) +
                     "; it has: " + (names.empty() ? "none" : joined(names, ", ")) +
                     " (configs ask for layers by image.layers and image.masks)");
  }
  return found;
}

Colour colourOfId(float id) {
  if (!(id > 0.0f)) return {0, 0, 0};
  // Hues a golden section apart, so that neighbouring numbers differ; two more sets of them
  const auto number = static_cast<unsigned>(std::min(id, 4e9f));
  const double hue = 6.0 * std::fmod(0.6180339887498949 * number, 1.0);
  const double value = std::array{1.0, 0.7, 0.85}[number % 3];
  const double saturation = std::array{0.75, 0.85, 0.4}[number / 3 % 3];
  const auto part = [&](double centre) {
    const double apart = std::abs(std::remainder(hue - centre, 6.0));
    const double full = std::clamp(2.0 - apart, 0.0, 1.0);
    return step(static_cast<float>(value * (1.0 - saturation * (1.0 - full))));
  };
  return {part(0.0), part(2.0), part(4.0)};
}

Rgb8 layerPicture(const Image& frame, const std::string& layer) {
  if (const auto three = threeOf(frame, layer, kColourParts); !three.empty())
    return colours(frame, three);
  if (const auto three = threeOf(frame, layer, kVectorParts); !three.empty()) {
    return picture(frame, three, [](const std::array<float, 3>& n) {
      if (n[0] == 0.0f && n[1] == 0.0f && n[2] == 0.0f) return Colour{};
      return Colour{step(0.5f + 0.5f * n[0]), step(0.5f + 0.5f * n[1]), step(0.5f + 0.5f * n[2])};
    });
  }
  const int channel = frame.channel(layer);
  if (layer.starts_with("id.")) {
    return picture(frame, {channel},
                   [](const std::array<float, 3>& v) { return colourOfId(v[0]); });
  }
  const auto gray = [](float unit) {
    const std::uint8_t v = step(unit);
    return Colour{v, v, v};
  };
  if (layer == "Z") {
    float nearest = std::numeric_limits<float>::infinity();
    for (int y = 0; y < frame.height; ++y) {
      for (int x = 0; x < frame.width; ++x) {
        const float z = frame.at(x, y, channel);
        if (z > 0.0f) nearest = std::min(nearest, z);
      }
    }
    return picture(frame, {channel}, [&](const std::array<float, 3>& v) {
      return gray(v[0] > 0.0f ? nearest / v[0] : 0.0f);
    });
  }
  return picture(frame, {channel}, [&](const std::array<float, 3>& v) { return gray(v[0]); });
}

}  // namespace catoptric::report
