#include "run/stage/encoder.h"

#include <utility>

#include "core/clock.h"
#include "image/exr_camera.h"
#include "run/folder/machine.h"

namespace catoptric::run {
namespace {

/// What a frame's file says of where it comes from, and of its camera.
image::ExrOptions exrOptions(const RunConfig& run, const MethodConfig& method,
                             const glm::dvec3& origin, const scene::PathFrame& path, float aspect) {
  image::ExrOptions options;
  options.compression = run.compression;
  options.halfBeauty = run.halfBeauty;
  options.text = {{"software", std::string("catoptric ") + versionText()},
                  {"catoptric.version", versionText()},
                  {"catoptric.name", method.name},
                  {"catoptric.seed", std::to_string(run.image.seed)},
                  {"catoptric.scene", run.scene.filename().string()},
                  {"catoptric.method", method.id},
                  {"catoptric.options", method.effective}};
  options.numbers = {{"catoptric.samplesPerAxis", static_cast<float>(run.image.samples)},
                     {"catoptric.frame", static_cast<float>(path.number)},
                     {"catoptric.time", static_cast<float>(path.timeSeconds)},
                     {"catoptric.verticalFovDegrees", degrees(path.camera.verticalFovRad)}};
  const Mat4 cameraFromFile(
      glm::translate(glm::dmat4(scene::cameraFromWorld(path.camera)), -origin));
  options.matrices["worldToCamera"] = image::exrWorldToCamera(cameraFromFile);
  options.matrices["worldToNDC"] = image::exrWorldToNdc(cameraFromFile, path.camera.verticalFovRad,
                                                        aspect, path.camera.nearMetres);
  return options;
}

EncodedFile encodedPreview(const image::Image& picture, int frame, const image::DisplayView& view) {
  const std::int64_t start = nowNs();
  EncodedFile preview;
  preview.path = framePath("previews", frame, ".png");
  preview.step = "preview";
  preview.bytes =
      image::encodePng(picture.width, picture.height, 3, image::displayRgb8(picture, view));
  preview.seconds = secondsSince(start);
  return preview;
}

}  // namespace

Encoder makeEncoder(const RunConfig& run, const MethodConfig& method, const glm::dvec3& origin) {
  return [run, method, origin](RenderedFrame& frame, const scene::PathFrame& path) {
    const image::Image& picture = frame.image;
    const std::int64_t start = nowNs();
    const float aspect = static_cast<float>(picture.width) / static_cast<float>(picture.height);
    image::ExrStatistics statistics;
    EncodedFile exr;
    exr.path = framePath("frames", path.number, ".exr");
    exr.step = "encode";
    exr.bytes =
        image::encodeExr(picture, exrOptions(run, method, origin, path, aspect), &statistics);
    exr.seconds = secondsSince(start);
    frame.counters["clamped_half"] = statistics.clampedHalf;

    std::vector<EncodedFile> files;
    files.push_back(std::move(exr));
    if (run.preview.enabled)
      files.push_back(encodedPreview(picture, path.number, run.preview.shown()));
    return files;
  };
}

}  // namespace catoptric::run
