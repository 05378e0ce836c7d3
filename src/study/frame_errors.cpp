#include "study/frame_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"

namespace catoptric::study {
namespace {

/// The standard error of the reference over all and over reflective pixels.
constexpr const char* kStandardError = "standard_error";
constexpr const char* kStandardErrorReflective = "standard_error_reflective";

/// The flicker of the reference's own error.
constexpr const char* kFlickerFloor = "flicker_floor";

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double metricOf(const FrameErrors& frame, const std::string& name) {
  const auto found = frame.metrics.find(name);
  return found == frame.metrics.end() ? kNone : found->second;
}

std::string frameText(const FrameErrors& frame) {
  config::JsonText metrics;
  for (const auto& [name, value] : frame.metrics) metrics.add(name, value);
  std::string objects;
  for (const auto& [id, part] : frame.objects)
    objects += (objects.empty() ? "[" : ",[") + std::to_string(id) + "," +
               std::to_string(part.pixels) + "," + std::to_string(part.sum8) + "]";
  return config::JsonText()
      .add("pixels", frame.pixels)
      .raw("metrics", metrics.object())
      .add("reflective_pixels", frame.reflectivePixels)
      .add("flicker_pixels", frame.flickerPixels)
      .add("elsewhere_pixels", frame.elsewherePixels)
      .raw("objects", "[" + objects + "]")
      .add("counters", frame.counters)
      .object();
}

FrameErrors readFrame(const config::Value& value) {
  FrameErrors frame;
  frame.pixels = value.get("pixels").asString();
  for (const std::string& name : value.get("metrics").keys())
    frame.metrics[name] = value.get("metrics").get(name).asNumber();
  frame.reflectivePixels = static_cast<std::uint64_t>(value.get("reflective_pixels").asInteger());
  frame.flickerPixels = static_cast<std::uint64_t>(value.get("flicker_pixels").asInteger());
  frame.elsewherePixels = static_cast<std::uint64_t>(value.get("elsewhere_pixels").asInteger());
  for (const config::Value& part : value.get("objects").asArray()) {
    const std::vector<config::Value>& three = part.asArray();
    frame.objects[static_cast<int>(three.at(0).asInteger())] = {
        static_cast<std::uint64_t>(three.at(1).asInteger()),
        static_cast<std::uint64_t>(three.at(2).asInteger())};
  }
  for (const std::string& name : value.get("counters").keys())
    frame.counters[name] = static_cast<std::uint64_t>(value.get("counters").get(name).asNumber());
  return frame;
}

}  // namespace

const std::vector<MetricInfo>& metrics() {
  static const std::vector<MetricInfo> all{
      {"L1_8bit", "mean absolute difference of 8-bit sRGB values"},
      {"L1_8bit_reflective", "L1_8bit over the pixels that show reflectors"},
      {"L1_8bit_elsewhere", "L1_8bit over the other pixels"},
      {"L1_8bit_one_bounce", "L1_8bit against the reference with one bounce"},
      {"max_8bit", "largest difference of 8-bit sRGB values"},
      {"mae", "mean absolute difference of linear radiance"},
      {"rmse", "root of the mean squared difference of linear radiance"},
      {"relmse", "mean squared difference, relative to the reference's squared radiance"},
      {"over_percent", "percent of the pixels that differ visibly"},
      {"flip_mean", "mean of LDR-FLIP [Andersson2020]"},
      {"hdr_flip_mean", "mean of HDR-FLIP [Andersson2021]"},
      {kFlicker, "mean change from frame to frame that the reference does not have"}};
  return all;
}

void requireMetric(const std::string& name) {
  std::vector<std::string> names;
  for (const MetricInfo& metric : metrics()) names.push_back(metric.name);
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw UsageError("\"" + name + "\" is not an error measure" + didYouMean(name, names) +
                     "; allowed: " + joined(names, ", "));
}

FrameErrors frameErrors(const report::RunComparison& comparison, int number) {
  const measure::ImageError& e = comparison.frames.at(number);
  FrameErrors frame;
  frame.metrics = {{"L1_8bit", e.l1()},     {"max_8bit", static_cast<double>(e.max8)},
                   {"mae", e.mae()},        {"rmse", e.rmse()},
                   {"relmse", e.relMse()},  {"over_percent", e.overPercent()},
                   {"flip_mean", e.flip()}, {"hdr_flip_mean", e.hdrFlip()}};
  if (e.hasReflective) {
    frame.metrics["L1_8bit_reflective"] = e.l1Reflective();
    frame.reflectivePixels = e.reflective.pixels;
    frame.metrics["L1_8bit_elsewhere"] = e.elsewhere.l1();
    frame.elsewherePixels = e.elsewhere.pixels;
  }
  const auto flicker = comparison.motion.frames.find(number);
  if (flicker != comparison.motion.frames.end()) {
    frame.metrics[kFlicker] = flicker->second.mean();
    frame.flickerPixels = flicker->second.pixels;
    if (comparison.motion.hasFloor) frame.metrics[kFlickerFloor] = flicker->second.floor();
  }
  if (e.hasOneBounce) {
    frame.metrics["L1_8bit_one_bounce"] = e.l1OneBounce();
    frame.metrics["L1_8bit_bounces"] = e.l1Bounces();
  }
  if (e.hasStandardError) frame.metrics[kStandardError] = e.standardError();
  if (e.hasStandardError && e.hasReflective)
    frame.metrics[kStandardErrorReflective] = e.reflective.standardError();
  for (const auto& [id, part] : e.objects) frame.objects[id] = {part.pixels, part.sum8};
  return frame;
}

double PointErrors::pooled(const std::string& metric, const std::vector<int>& ofFrames) const {
  double sum = 0.0;
  double weights = 0.0;
  for (const int number : ofFrames) {
    const auto found = frames.find(number);
    if (found == frames.end()) return kNone;
    const double value = metricOf(found->second, metric);
    if (metric == "max_8bit") {
      sum = std::max(sum, value);
      weights = 1.0;
      continue;
    }
    const FrameErrors& frame = found->second;
    const double weight =
        metric.ends_with("_reflective")  ? static_cast<double>(frame.reflectivePixels)
        : metric.ends_with("_elsewhere") ? static_cast<double>(frame.elsewherePixels)
        : metric.starts_with(kFlicker)   ? static_cast<double>(frame.flickerPixels)
                                         : 1.0;
    if (weight == 0.0) continue;  // a frame without such pixels, or without one before it
    sum += weight * (metric == "rmse" ? value * value : value);
    weights += weight;
  }
  if (weights == 0.0) return kNone;
  return metric == "rmse" ? std::sqrt(sum / weights) : sum / weights;
}

int PointErrors::worstFrame(const std::string& metric, const std::vector<int>& ofFrames) const {
  int worst = 0;
  double most = -1.0;
  for (const int number : ofFrames) {
    const auto found = frames.find(number);
    if (found == frames.end()) continue;
    const double value = metricOf(found->second, metric);
    if (value > most) {
      most = value;
      worst = number;
    }
  }
  return worst;
}

double PointErrors::uncertainty(const std::string& metric, const std::vector<int>& ofFrames) const {
  const double known = metric == "L1_8bit"              ? pooled(kStandardError, ofFrames)
                       : metric == "L1_8bit_reflective" ? pooled(kStandardErrorReflective, ofFrames)
                       : metric == kFlicker             ? pooled(kFlickerFloor, ofFrames)
                                                        : kNone;
  return std::isnan(known) ? 0.0 : known;
}

double PointErrors::meanCounter(const std::string& name, const std::vector<int>& ofFrames) const {
  double sum = 0.0;
  for (const int number : ofFrames) {
    const auto found = frames.find(number);
    if (found == frames.end()) return kNone;
    const auto counter = found->second.counters.find(name);
    if (counter != found->second.counters.end()) sum += static_cast<double>(counter->second);
  }
  return sum / static_cast<double>(ofFrames.size());
}

PointErrors readErrors(const std::filesystem::path& file) {
  PointErrors errors;
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return errors;
  const config::Value root = config::parseFile(file);
  for (const std::string& number : root.keys())
    errors.frames[std::stoi(number)] = readFrame(root.get(number));
  return errors;
}

void writeErrors(const std::filesystem::path& file, const PointErrors& errors) {
  config::JsonText text;
  for (const auto& [number, frame] : errors.frames)
    text.raw(std::to_string(number), frameText(frame));
  std::filesystem::create_directories(file.parent_path());
  writeFileAtomically(file, std::string_view(text.object() + "\n"));
}

}  // namespace catoptric::study
