// Classes of pixels, to find out which pixels cause the error of a frame.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "image/image.h"

namespace catoptric::measure {

/// The error of a set of pixels.
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
/// The error of the pixels of one class. It tells where a better method would gain most.
struct ErrorClass {
  std::string name;
  ErrorShare all;  ///< error of every pixel of the class; classes overlap
  ErrorShare own;  ///< error of the pixels that belong to no earlier class; these add up to the
                   ///< frame's error
};

/// A layer: an image and the index of a channel in it; null if no image has the layer.
struct Layer {
  const image::Image* image = nullptr;
  int channel = -1;

  float at(std::size_t pixel) const {
    return image->data[pixel * image->channels.size() + static_cast<std::size_t>(channel)];
  }
  explicit operator bool() const { return image != nullptr; }
};

/// The first of these layers that the image has, or that the reference has.
Layer findLayer(const image::Image& image, const image::Image& reference,
                std::initializer_list<const char*> names);

/// The layers that assign pixels to classes. A layer that the image lacks is taken from the
/// reference. The classes are, in order: masks, silhouettes (edges of id.object), glossy, other
/// reflective pixels, the rest.
class Classes {
 public:
  Classes(const image::Image& image, const image::Image& reference);

  /// All classes, with zero counts.
  std::vector<ErrorClass> empty() const;
  /// Adds a pixel's error to its classes; `all` comes from empty().
  void count(std::vector<ErrorClass>& all, int x, int y, bool isReflective,
             const ErrorShare& share) const;
  /// The ids of reflective objects. At an edge, a pixel may be reflective although its centre
  /// sample, which determines its id, is not. Therefore only some pixels count: those whose samples
  /// are all reflective, or, if there is only the layer `s` (a mean over samples), those that do
  /// not lie at an edge.
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
