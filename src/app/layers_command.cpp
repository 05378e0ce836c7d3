// catoptric layers FRAMES.
#include <fmt/core.h>

#include <filesystem>
#include <memory>

#include "app/commands.h"
#include "config/json_text.h"
#include "core/file.h"
#include "core/text.h"
#include "image/image.h"
#include "report/layer_pictures.h"
#include "report/run_data.h"

namespace catoptric::app {
namespace {

struct LayersOptions {
  std::string frames;
  std::string out;
  std::vector<std::string> layers;
};

ExitCode layers(const LayersOptions& options, const CommonOptions& common) {
  std::vector<std::string> written;
  for (const auto& [number, file] : report::readSequence(options.frames).frames) {
    const image::Image frame = image::readImage(file);
    std::vector<std::string> names;
    if (options.layers.empty()) names = report::layerNames(frame);
    for (const std::string& layer : options.layers) {
      for (const std::string& name : report::layersNamed(frame, layer, file.string()))
        names.push_back(name);
    }
    if (names.empty()) continue;
    std::error_code error;
    std::filesystem::create_directories(options.out, error);
    if (error) throw OutputError(options.out + ": cannot be created: " + error.message());
    for (const std::string& name : names) {
      const report::Rgb8 picture = report::layerPicture(frame, name);
      const std::filesystem::path to =
          std::filesystem::path(options.out) / fmt::format("frame.{:04}.{}.png", number, name);
      writeFileAtomically(to, image::encodePng(picture.width, picture.height, 3, picture.rgb));
      written.push_back(to.string());
    }
  }
  if (written.empty()) {
    throw UsageError(options.frames +
                     ": the frames have only R, G, B and A; render them with image.layers or "
                     "image.masks=true to get layers");
  }
  std::string text;
  if (common.json) {
    for (const std::string& file : written)
      text += (text.empty() ? "[" : ",") + config::jsonString(file);
    printData(text + "]\n");
    return ExitCode::Done;
  }
  printData(joined(written, "\n") + "\n");
  return ExitCode::Done;
}

}  // namespace

Command layersCommand(CommonOptions& common) {
  const auto options = std::make_shared<LayersOptions>();
  const Rows own = {
      option("frames", options->frames, "FRAMES", kFramesHelp, {.required = true}),
      option("--out", options->out, "DIR", "Folder for the pictures, frame.0001.LAYER.png, ...",
             {.required = true, .notEmpty = true}),
      option("--layer", options->layers, "NAME",
             "Draw only these layers, separated by commas: cluster, id, mask, N, Z, ... [all but "
             "R, G, B, A]",
             {.notEmpty = true, .commas = true}),
  };
  return {
      "layers", "Draw the layers of frames as PNG pictures: ids, masks, normals, depth.",
      own + commonRows(common),
      R"(Each id gets its own colour. Masks and s are gray, from 0 (black) to 1 (white). Depth Z is gray; the
nearest point is white.

Example:
  catoptric render configs/demo.json --out out/demo --set 'image.layers=["cluster","id"]'
  catoptric layers out/demo/second_order --layer cluster --out out/pictures
)",
      [options, &common] { return layers(*options, common); }};
}

}  // namespace catoptric::app
