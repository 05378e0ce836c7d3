// Classes of pixels: on which of them the error of a frame falls.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "image/image.h"

namespace catoptric::measure {

/// A part of the error of a frame.
struct ErrorShare {
  std::uint64_t pixels = 0;
  std::uint64_t sum8 = 0;
  double sumSquared = 0.0;
  double hdrFlipSum = 0.0;

  void add(const ErrorShare& other) {
    pixels += other.pixels;
    sum8 += other.sum8;
    sumSquared += other.sumSquared;
    hdrFlipSum += other.hdrFlipSum;
  }
};
/// How much of the error falls on pixels of one class: where accuracy would be won.
struct ErrorClass {
  std::string name;
  ErrorShare all;  ///< of every pixel of the class; classes overlap
  ErrorShare own;  ///< of the pixels that belong to no earlier class: these add up to the frame
};

/// Where a layer is: an image and its channel; null when nobody has it.
struct Layer {
  const image::Image* image = nullptr;
  int channel = -1;

  float at(std::size_t pixel) const {
    return image->data[pixel * image->channels.size() + static_cast<std::size_t>(channel)];
  }
  explicit operator bool() const { return image != nullptr; }
};

/// The layers that put a pixel into a class, of the image or else of the reference, the most
/// telling first: masks, silhouettes (edges of id.object), glossy, other reflective pixels, the
/// rest.
class Classes {
 public:
  Classes(const image::Image& image, const image::Image& reference);

  /// All classes, with nothing counted.
  std::vector<ErrorClass> empty() const;
  /// Adds a pixel's error to its classes; `all` are those of empty().
  void count(std::vector<ErrorClass>& all, int x, int y, bool isReflective,
             const ErrorShare& share) const;
  /// Ids of objects that reflect. At an edge the pixel reflects while its middle sample, whose id
  /// it has, may not: trusted are pixels all samples of which reflect, or (layer `s` alone, a mean)
  /// those that lie at no edge.
  std::set<int> reflectors() const;

  const Layer& id() const { return id_; }
  const Layer& reflective() const { return reflective_; }

 private:
  bool silhouette(int x, int y) const;

  std::vector<std::pair<std::string, Layer>> masks_;
  Layer id_;
  Layer glossy_;
  Layer reflective_;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace catoptric::measure
