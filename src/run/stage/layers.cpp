#include "run/stage/layers.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "methods/contract/layers.h"
#include "raster/gbuffer.h"

namespace catoptric::run {
namespace {

/// Appends channels computed per pixel to an interleaved image.
class ChannelAppender {
 public:
  ChannelAppender(image::Image& image, int samples) : image_(image), samples_(samples) {}

  /// `value(sample)` of the pixel's middle sample.
  template <class Value>
  void middle(const std::string& name, Value&& value) {
    add(name, [&](int x, int y) {
      return value(sampleIndex(x * samples_ + samples_ / 2, y * samples_ + samples_ / 2));
    });
  }
  /// Mean of `value(sample)` over the pixel's samples.
  template <class Value>
  void mean(const std::string& name, Value&& value) {
    add(name, [&](int x, int y) {
      float sum = 0.0f;
      for (int j = 0; j < samples_; ++j)
        for (int i = 0; i < samples_; ++i)
          sum += value(sampleIndex(x * samples_ + i, y * samples_ + j));
      return sum / static_cast<float>(samples_ * samples_);
    });
  }
  /// `value(pixel)`.
  template <class Value>
  void pixels(const std::string& name, Value&& value) {
    add(name, [&](int x, int y) {
      return value(static_cast<std::size_t>(y) * image_.width + static_cast<std::size_t>(x));
    });
  }
  /// Interleaves what was added.
  void finish() {
    const std::size_t old = image_.channels.size();
    const std::size_t total = old + names_.size();
    std::vector<float> data(image_.pixelCount() * total);
    for (std::size_t p = 0; p < image_.pixelCount(); ++p) {
      std::copy_n(image_.data.begin() + static_cast<std::ptrdiff_t>(p * old), old,
                  data.begin() + static_cast<std::ptrdiff_t>(p * total));
      for (std::size_t c = 0; c < names_.size(); ++c) data[p * total + old + c] = planes_[c][p];
    }
    image_.data = std::move(data);
    image_.channels.insert(image_.channels.end(), names_.begin(), names_.end());
  }

 private:
  std::size_t sampleIndex(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(image_.width * samples_) +
           static_cast<std::size_t>(i);
  }
  template <class PixelValue>
  void add(const std::string& name, PixelValue&& value) {
    std::vector<float> plane(image_.pixelCount());
    for (int y = 0; y < image_.height; ++y)
      for (int x = 0; x < image_.width; ++x)
        plane[static_cast<std::size_t>(y) * image_.width + x] = value(x, y);
    names_.push_back(name);
    planes_.push_back(std::move(plane));
  }

  image::Image& image_;
  int samples_;
  std::vector<std::string> names_;
  std::vector<std::vector<float>> planes_;
};

}  // namespace

void addLayers(image::Image& image, const SampleLayers& layers, int samples, float nearMetres) {
  ChannelAppender out(image, samples);
  const auto rgb = [&](const std::string& prefix, const std::vector<float>& texels) {
    const std::array names = {"R", "G", "B"};
    for (std::size_t c = 0; c < 3; ++c)
      out.mean(prefix + "." + names[c], [&, c](std::size_t s) { return texels[s * 4 + c]; });
  };
  // Distance along -z, metres; 0 where there is nothing.
  if (!layers.depth.empty())
    out.middle("Z", [&](std::size_t s) {
      return layers.depth[s] > 0.0f ? nearMetres / layers.depth[s] : 0.0f;
    });
  if (!layers.normal.empty() && layers.wantNormal) {
    const std::array names = {"N.X", "N.Y", "N.Z"};
    for (std::size_t c = 0; c < 3; ++c)
      out.middle(names[c], [&, c](std::size_t s) { return layers.normal[s * 4 + c]; });
  }
  // What lies in the reflection target of a sample that does not reflect is of an earlier frame.
  const auto reflects = [&](std::size_t s) { return layers.diffuse[s * 4 + 3] > 0.0f; };
  if (!layers.reflection.empty()) {
    const std::array names = {"reflection.R", "reflection.G", "reflection.B"};
    for (std::size_t c = 0; c < 3; ++c)
      out.mean(names[c],
               [&, c](std::size_t s) { return reflects(s) ? layers.reflection[s * 4 + c] : 0.0f; });
  }
  if (!layers.diffuse.empty() && layers.wantDiffuse) rgb("diffuse", layers.diffuse);
  if (!layers.diffuse.empty() && layers.wantSpecular)
    out.mean("s", [&](std::size_t s) { return std::max(0.0f, layers.diffuse[s * 4 + 3]); });
  if (!layers.object.empty())
    out.middle("id.object", [&](std::size_t s) { return static_cast<float>(layers.object[s]); });
  for (const methods::SampleLayer& layer : layers.ids) {
    if (layer.vectors.empty())
      out.middle("id." + layer.name,
                 [&](std::size_t s) { return static_cast<float>(layer.numbers[s]); });
    for (int c = 0; c < 3 && !layer.vectors.empty(); ++c)
      out.middle(layer.name + "." + "XYZ"[c], [&](std::size_t s) { return layer.vectors[s][c]; });
  }
  for (int c = 0; c < 3 && !layers.motion.empty(); ++c)
    out.pixels(std::string("motion.") + "XYZ"[c],
               [&](std::size_t p) { return layers.motion[p][c]; });
  if (!layers.masks.empty()) {
    out.mean("mask.reflective", [&](std::size_t s) { return reflects(s) ? 1.0f : 0.0f; });
    if (!layers.normal.empty())
      out.mean("mask.glossy", [&](std::size_t s) {
        return reflects(s) && raster::lobeOf(layers.normal[s * 4 + 3]).roughness() > 0.0f ? 1.0f
                                                                                          : 0.0f;
      });
    for (const methods::MaskInfo& mask : methods::kMasks) {
      if ((layers.filledMasks & mask.bit) == 0) continue;
      out.mean(mask.name, [&, b = mask.bit](std::size_t s) {
        return reflects(s) && (layers.masks[s] & b) != 0 ? 1.0f : 0.0f;
      });
    }
  }
  out.finish();
}

const std::vector<methods::SampleLayerInfo>& frameLayers() {
  static const std::vector<methods::SampleLayerInfo> all = [] {
    std::vector<methods::SampleLayerInfo> layers = {
        {"Z", "distance along the view direction, metres"},
        {"N", "shading normal, world space"},
        {"reflection", "reflected radiance, before it is weighted by s"},
        {"diffuse", "diffuse radiance, before it is weighted by 1 - s"},
        {"s", "reflectance"},
        {"id", "number of the object, and the numbers that the method gives"},
        {"motion", "pixels by which the surface point has moved"},
        {"mask.reflective", "share of the pixel's samples that lie on reflectors"},
        {"mask.glossy", "share of samples that lie on reflectors with roughness above 0"}};
    for (const methods::MaskInfo& mask : methods::kMasks)
      layers.push_back({mask.name, std::string("share of samples that ") + mask.meaning});
    return layers;
  }();
  return all;
}

}  // namespace catoptric::run
