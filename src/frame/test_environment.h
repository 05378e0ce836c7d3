// Writes environment images for tests.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <string>

#include "core/file.h"
#include "core/math.h"
#include "image/image.h"

namespace catoptric::test {

/// Writes an EXR file of 32-bit floats to the tests' folder: a latitude-longitude image of
/// `radiance` as a function of direction (y is up), evaluated at each pixel's centre.
inline std::filesystem::path writeEnvironment(const std::string& name, int width, int height,
                                              const std::function<Vec3(const Vec3&)>& radiance) {
  image::Image image;
  image.width = width;
  image.height = height;
  image.channels = {"R", "G", "B"};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float theta = kPi * (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
      const float phi =
          2.0f * kPi * ((static_cast<float>(x) + 0.5f) / static_cast<float>(width) - 0.5f);
      const Vec3 value = radiance(
          {std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi)});
      image.data.insert(image.data.end(), {value.x, value.y, value.z});
    }
  }
  image::ExrOptions options;
  options.halfBeauty = false;
  std::filesystem::path file = std::filesystem::path(testing::TempDir()) / name;
  writeFileAtomically(file, image::encodeExr(image, options));
  return file;
}

}  // namespace catoptric::test
