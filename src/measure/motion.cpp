#include "measure/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "measure/colours.h"
#include "measure/display_steps.h"
#include "measure/error_classes.h"
#include "measure/errors.h"

namespace catoptric::measure {
namespace {

using image::Image;

/// Two distances along the view axis are those of one surface if they differ by no more than this
/// fraction. Ours: reflectors are smooth.
constexpr float kSameDistance = 0.02f;

/// Places are rounded to this part of a pixel, so that rounding errors reach no further pixel.
constexpr float kParts = 1024.0f;

/// The sum over R, G, B of |now - last| at one pixel; 0 if one of them is empty.
int change(const std::vector<std::int16_t>& now, const std::vector<std::int16_t>& last,
           std::size_t pixel) {
  int sum = 0;
  if (now.empty() || last.empty()) return sum;
  for (std::size_t c = 3 * pixel; c < 3 * pixel + 3; ++c) sum += std::abs(now[c] - last[c]);
  return sum;
}

void addPixel(Flicker& flicker, double sum, double floor) {
  ++flicker.pixels;
  flicker.sum += sum;
  flicker.floorSum += floor;
}

/// E of the frame before at a place between pixel centres: bilinear over the pixels that show the
/// same object at about the same distance. False if one of them does not, or lies outside.
bool lastError(const SignedError& last, float x, float y, int object, float distance,
               std::array<float, 3>& error) {
  const float column0 = std::round((x - 0.5f) * kParts) / kParts;
  const float row0 = std::round((y - 0.5f) * kParts) / kParts;
  const float left = std::floor(column0);
  const float top = std::floor(row0);
  const float right = column0 - left;  // weight of the pixels to the right
  const float below = row0 - top;
  error = {0.0f, 0.0f, 0.0f};
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      const float weight = (i == 1 ? right : 1.0f - right) * (j == 1 ? below : 1.0f - below);
      if (weight == 0.0f) continue;
      const float column = left + static_cast<float>(i);
      const float row = top + static_cast<float>(j);
      if (!(column >= 0.0f && row >= 0.0f && column < static_cast<float>(last.width) &&
            row < static_cast<float>(last.height)))
        return false;
      const std::size_t p = static_cast<std::size_t>(row) * static_cast<std::size_t>(last.width) +
                            static_cast<std::size_t>(column);
      if (last.counted[p] == 0 || last.objects[p] != object ||
          !(std::abs(last.distance[p] - distance) <= kSameDistance * distance))
        return false;
      for (std::size_t c = 0; c < 3; ++c)
        error[c] += weight * static_cast<float>(last.steps[3 * p + c]);
    }
  return true;
}

/// Sums over tiles of kTile x kTile pixels.
class Tiles {
 public:
  Tiles(int width, int height)
      : width_(width),
        height_(height),
        columns_((width + kTile - 1) / kTile),
        sums_(static_cast<std::size_t>(columns_) * ((height + kTile - 1) / kTile)) {}

  void add(int x, int y, int sum) {
    sums_[static_cast<std::size_t>(y / kTile) * columns_ + x / kTile] += sum;
  }
  /// The middle of the tile with the largest mean per pixel and channel, and this mean.
  void largest(MotionError& result) const {
    result.worstTile = -1.0;
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      const int x0 = static_cast<int>(i) % columns_ * kTile;
      const int y0 = static_cast<int>(i) / columns_ * kTile;
      const int x1 = std::min(width_, x0 + kTile);
      const int y1 = std::min(height_, y0 + kTile);
      const double mean = static_cast<double>(sums_[i]) / (3.0 * (x1 - x0) * (y1 - y0));
      if (mean <= result.worstTile) continue;
      result.worstTile = mean;
      result.worstX = (x0 + x1) / 2;
      result.worstY = (y0 + y1) / 2;
    }
  }

 private:
  static constexpr int kTile = MotionError::kTile;

  int width_;
  int height_;
  int columns_;
  std::vector<std::int64_t> sums_;
};

}  // namespace

SignedError signedError(const Image& image, const Image& reference, const std::string& name) {
  requireSameSize(image, reference, name);
  const std::array<int, 3> from = colourChannels(image, name);
  const std::array<int, 3> to = colourChannels(reference, name + " (reference)");
  const Classes classes(image, reference);
  const Layer distance = findLayer(image, reference, {"Z"});
  const std::array<Layer, 3> motion = {findLayer(image, reference, {"motion.X"}),
                                       findLayer(image, reference, {"motion.Y"}),
                                       findLayer(image, reference, {"motion.Z"})};
  SignedError e;
  e.width = image.width;
  e.height = image.height;
  e.hasReflective = static_cast<bool>(classes.reflective());
  const std::size_t pixels = image.pixelCount();
  e.steps.resize(3 * pixels);
  e.counted.assign(pixels, 1);
  const ColourView standardError = layerColours(reference, "standard_error");
  if (standardError.image != nullptr) e.truthSteps.resize(3 * pixels);
  if (classes.id()) e.objects.resize(pixels);
  e.reflectors = classes.reflectors();
  if (distance) e.distance.resize(pixels);
  if (motion[0] && motion[1] && motion[2]) e.motion.resize(3 * pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float a = image.data[p * image.channels.size() + static_cast<std::size_t>(from[c])];
      const float b =
          reference.data[p * reference.channels.size() + static_cast<std::size_t>(to[c])];
      e.steps[3 * p + c] = static_cast<std::int16_t>(
          std::isfinite(a) && std::isfinite(b) ? step8(a) - step8(b) : 255);
      if (e.truthSteps.empty()) continue;
      const float shown = image::display8(b);
      const float own = Layer{&reference, standardError.channels[c]}.at(p);
      if (!std::isfinite(shown) || !std::isfinite(own)) continue;
      e.truthSteps[3 * p + c] =
          static_cast<std::int16_t>(std::lround(shown + own) - std::lround(shown));
    }
    if (e.hasReflective) e.counted[p] = classes.reflective().at(p) > 0.0f ? 1 : 0;
    if (classes.id()) e.objects[p] = static_cast<int>(classes.id().at(p));
    if (distance) e.distance[p] = distance.at(p);
    for (std::size_t c = 0; c < 3 && !e.motion.empty(); ++c) e.motion[3 * p + c] = motion[c].at(p);
  }
  return e;
}

double Flicker::mean() const {
  return quotient(sum, 3.0 * static_cast<double>(pixels));
}

double Flicker::floor() const {
  return quotient(floorSum, 3.0 * static_cast<double>(pixels));
}

double MotionError::steady() const {
  return std::sqrt(quotient(steadySquared, 3.0 * static_cast<double>(windowPixels)));
}
double MotionError::unsteady() const {
  return std::sqrt(quotient(unsteadySquared, 3.0 * static_cast<double>(windowPixels)));
}
double MotionError::unmatchedPercent() const {
  return 100.0 * quotient(static_cast<double>(unmatched),
                          static_cast<double>(unmatched + alongMotion.pixels));
}

std::vector<float> MotionMeter::add(int number, SignedError error) {
  std::vector<float> changes;
  const bool consecutive = last_ && number == lastNumber_ + 1 && last_->width == error.width &&
                           last_->height == error.height;
  if (last_ && !consecutive) {
    result_.gaps.push_back(number);
    windowFrames_ = 0;
  }
  if (consecutive) changes = addPair(number, error);
  addToWindow(error);
  last_ = std::move(error);
  lastNumber_ = number;
  return changes;
}

std::vector<float> MotionMeter::addPair(int number, const SignedError& now) {
  ++result_.pairs;
  result_.hasReflective = result_.hasReflective || now.hasReflective;
  result_.hasFloor = result_.hasFloor || !now.truthSteps.empty();
  Flicker& frame = result_.frames[number];
  Tiles tiles(now.width, now.height);
  std::vector<float> changes(now.counted.size());
  for (int y = 0; y < now.height; ++y)
    for (int x = 0; x < now.width; ++x) {
      const std::size_t p = static_cast<std::size_t>(y) * static_cast<std::size_t>(now.width) +
                            static_cast<std::size_t>(x);
      if (now.counted[p] == 0 || last_->counted[p] == 0) continue;
      const int sum = change(now.steps, last_->steps, p);
      changes[p] = static_cast<float>(sum) / 3.0f;
      const int floor = change(now.truthSteps, last_->truthSteps, p);
      addPixel(frame, sum, floor);
      tiles.add(x, y, sum);
      if (!now.objects.empty() && !last_->objects.empty() && now.objects[p] == last_->objects[p] &&
          now.reflectors.contains(now.objects[p]))
        addPixel(result_.objects[now.objects[p]], sum, floor);
    }
  result_.all.pixels += frame.pixels;
  result_.all.sum += frame.sum;
  result_.all.floorSum += frame.floorSum;
  if (result_.worstFrame == 0 || frame.mean() > result_.frames.at(result_.worstFrame).mean()) {
    result_.worstFrame = number;
    tiles.largest(result_);
  }
  if (!now.motion.empty() && !now.objects.empty() && !last_->objects.empty() &&
      !last_->distance.empty())
    addAlongMotion(now);
  return changes;
}

void MotionMeter::addAlongMotion(const SignedError& now) {
  result_.hasMotion = true;
  std::array<float, 3> error{};
  for (int y = 0; y < now.height; ++y)
    for (int x = 0; x < now.width; ++x) {
      const std::size_t p = static_cast<std::size_t>(y) * static_cast<std::size_t>(now.width) +
                            static_cast<std::size_t>(x);
      if (now.counted[p] == 0) continue;
      const float distance = now.motion[3 * p + 2];
      if (!(distance > 0.0f) || !lastError(*last_, static_cast<float>(x) + 0.5f - now.motion[3 * p],
                                           static_cast<float>(y) + 0.5f - now.motion[3 * p + 1],
                                           now.objects[p], distance, error)) {
        ++result_.unmatched;
        continue;
      }
      double sum = 0.0;
      for (std::size_t c = 0; c < 3; ++c)
        sum += std::abs(static_cast<double>(now.steps[3 * p + c]) - double{error[c]});
      addPixel(result_.alongMotion, sum, 0.0);
    }
}

void MotionMeter::addToWindow(const SignedError& now) {
  if (windowFrames_ == 0) {
    windowCounts_.assign(now.counted.size(), 0);
    windowSums_.assign(now.steps.size(), 0);
    windowSquares_.assign(now.steps.size(), 0);
  }
  for (std::size_t p = 0; p < now.counted.size(); ++p) windowCounts_[p] += now.counted[p];
  for (std::size_t i = 0; i < now.steps.size(); ++i) {
    windowSums_[i] += now.steps[i];
    windowSquares_[i] += now.steps[i] * now.steps[i];
  }
  if (++windowFrames_ < MotionError::kWindow) return;
  windowFrames_ = 0;
  constexpr double n = MotionError::kWindow;
  for (std::size_t p = 0; p < windowCounts_.size(); ++p) {
    if (windowCounts_[p] < MotionError::kWindow) continue;
    ++result_.windowPixels;
    for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) {
      const double mean = windowSums_[c] / n;
      result_.steadySquared += mean * mean;
      result_.unsteadySquared += windowSquares_[c] / n - mean * mean;
    }
  }
}

}  // namespace catoptric::measure
