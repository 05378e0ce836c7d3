// catoptric figure RUN...
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>

#include "app/commands.h"
#include "core/file.h"
#include "core/log.h"
#include "core/text.h"
#include "report/figure.h"
#include "report/run_data.h"
#include "report/table.h"

namespace catoptric::app {
namespace {

struct FigureOptions {
  std::vector<std::string> runs;
  std::vector<int> frames;
  std::vector<std::string> crops;
  std::vector<std::string> labels;
  std::string title;
  std::string against;
  std::string out;
  report::Shown shown;
  int columns = 0;
};

report::Crop parseCrop(const std::string& text) {
  std::vector<int> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (bool more = true; more;) {
    int number = 0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error != std::errc()) break;
    numbers.push_back(number);
    more = next != end && *next == ',';
    at = more ? next + 1 : next;
  }
  if (at != end || numbers.size() != 4 || numbers[2] < 1 || numbers[3] < 1)
    throw UsageError("--crop \"" + text +
                     "\": must be X,Y,WIDTH,HEIGHT in pixels, from the upper left corner");
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

/// Two single files may have any numbers.
bool isFile(const report::RunData& run) {
  return run.frames.size() == 1 && std::filesystem::is_regular_file(run.folder);
}

std::filesystem::path frameOf(const report::RunData& run, int number) {
  if (isFile(run)) return run.frames.begin()->second;
  const auto found = run.frames.find(number);
  if (found != run.frames.end()) return found->second;
  throw UsageError(run.folder.string() + ": it has no frame " + std::to_string(number) +
                   "; it has " + std::to_string(run.frames.size()) + " frames from " +
                   std::to_string(run.frames.begin()->first) + " to " +
                   std::to_string(run.frames.rbegin()->first) +
                   ". Frames of different numbers are put side by side as files: " +
                   run.frames.begin()->second.string());
}

/// The first frame that all runs have; if there is none, the first of the first run.
int firstCommonFrame(const std::vector<report::RunData>& runs, const report::RunData* against) {
  const auto folder = std::ranges::find_if_not(runs, isFile);
  const report::RunData& first = folder != runs.end() ? *folder : runs.front();
  for (const auto& frame : first.frames) {
    const auto hasFrame = [&](const report::RunData& run) {
      return isFile(run) || run.frames.contains(frame.first);
    };
    if (std::ranges::all_of(runs, hasFrame) && (against == nullptr || hasFrame(*against)))
      return frame.first;
  }
  return first.frames.begin()->first;
}

/// The rows of a frame: the runs side by side, and below them their differences.
void addRows(report::Figure& figure, const FigureOptions& options,
             const std::vector<report::RunData>& runs, const report::RunData* against, int frame,
             const report::Crop& crop) {
  report::PanelRow pictures;
  report::PanelRow differences;
  if (options.frames.size() > 1) pictures.heading = "frame " + std::to_string(frame);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    report::Shown shown = options.shown;
    shown.crop = crop;
    shown.frame = frameOf(runs[i], frame);
    shown.difference = 0;
    std::string label = options.labels.empty() ? runs[i].name : options.labels[i];
    const bool compared = against != nullptr && frameOf(*against, frame) != shown.frame;
    if (compared) {
      shown.against = frameOf(*against, frame);
      label += (label.empty() ? "" : ", ") +
               std::string(crop.width > 0 ? "crop L1_8bit " : "L1_8bit ") +
               report::fixedText(report::l1Of(shown.frame, shown.against, false, crop), 3);
    }
    pictures.panels.push_back({label, report::pictureOf(shown)});
    shown.difference = options.shown.difference;
    if (compared && shown.difference > 0)
      differences.panels.push_back(
          {"difference x" + std::to_string(shown.difference), report::pictureOf(shown)});
  }
  figure.rows.push_back(std::move(pictures));
  if (!differences.panels.empty()) figure.rows.push_back(std::move(differences));
}

/// The same panels with so many in a row.
void wrap(report::Figure& figure, std::size_t columns) {
  report::Figure wrapped{figure.title, {}};
  for (report::PanelRow& row : figure.rows)
    for (report::Panel& panel : row.panels) {
      if (wrapped.rows.empty() || wrapped.rows.back().panels.size() == columns)
        wrapped.rows.emplace_back();
      if (!row.heading.empty()) panel.label += ", " + row.heading;
      wrapped.rows.back().panels.push_back(std::move(panel));
    }
  figure = std::move(wrapped);
}

ExitCode figure(const FigureOptions& options, const CommonOptions&) {
  if (options.shown.difference > 0 && options.against.empty())
    throw UsageError("--difference needs --against RUN");
  if (!options.labels.empty() && options.labels.size() != options.runs.size())
    throw UsageError("--labels has " + std::to_string(options.labels.size()) + " texts for " +
                     std::to_string(options.runs.size()) + " runs");
  std::vector<report::Crop> crops;
  for (const std::string& text : options.crops) crops.push_back(parseCrop(text));
  if (crops.empty()) crops.emplace_back();
  std::vector<report::RunData> runs;
  for (const std::string& run : options.runs) runs.push_back(report::readSequence(run));
  report::RunData against;
  if (!options.against.empty()) against = report::readSequence(options.against);
  const report::RunData* const compared = options.against.empty() ? nullptr : &against;
  const std::vector<int> frames =
      options.frames.empty() ? std::vector<int>{firstCommonFrame(runs, compared)} : options.frames;
  report::Figure made{options.title, {}};
  for (const int frame : frames)
    for (const report::Crop& crop : crops) addRows(made, options, runs, compared, frame, crop);
  if (options.columns > 0) wrap(made, static_cast<std::size_t>(options.columns));
  writeFileAtomically(options.out, report::drawFigure(made, options.out));
  log::info("figure: " + options.out);
  return ExitCode::Done;
}

}  // namespace

Command figureCommand(CommonOptions& common) {
  const auto options = std::make_shared<FigureOptions>();
  const Rows own = {
      option("runs", options->runs, "RUN", "Folders of runs, folders of EXR files, or EXR files",
             {.required = true}),
      option("--out", options->out, "FILE", "The figure: .png, .pdf or .svg",
             {.required = true, .notEmpty = true}),
      option("--frame", options->frames, "N",
             "Frames, separated by commas; each gets a row [the first that all runs have]",
             {.commas = true}),
      option("--crop", options->crops, "X,Y,W,H",
             "Show only this part, in pixels from the upper left corner; each --crop gets a row",
             {.notEmpty = true, .oneEach = true}),
      option("--zoom", options->shown.zoom, "N", "Enlarge each pixel to a square of N x N pixels",
             {.least = 1, .most = 64, .showsDefault = true}),
      option("--width", options->shown.width, "PIXELS",
             "Shrink wider panels to this width [0: no limit]", {.least = 0, .most = 65535}),
      option("--layer", options->shown.layer, "NAME",
             "Show this layer instead of the colours, drawn as by `catoptric layers`",
             {.notEmpty = true}),
      option("--mask", options->shown.mask, "NAME", "Mark the pixels of the layer mask.NAME in red",
             {.notEmpty = true}),
      option("--against", options->against, "RUN",
             "Label each panel with its L1_8bit against this run; with --crop, that of the part",
             {.notEmpty = true}),
      option("--difference", options->shown.difference, "GAIN",
             "Add a row below: the difference from --against in 8-bit sRGB values, times GAIN",
             {.least = 0, .most = 255}),
      option("--labels", options->labels, "TEXT",
             "Labels of the runs, separated by commas [the names of their folders]",
             {.commas = true}),
      option("--title", options->title, "TEXT", "Line of text above the figure"),
      option("--columns", options->columns, "N", "Panels in a row [0: one for each run]",
             {.least = 0, .most = 1000}),
  };
  return {"figure",
          "Put frames of runs side by side, with crops, differences and labels, as a figure for a "
          "paper.",
          own + commonRows(common),
          R"(Labels in PDF and SVG files are text.

Example:
  catoptric figure out/demo/second_order out/demo/traced --against out/demo/traced --difference 50 \
      --frame 1 --crop 100,80,160,120 --zoom 2 --out figure.pdf
)" + exitCodes({{"2", "the command line is wrong, or a frame, layer or part does not exist"},
                {"3", "a frame is damaged"},
                {"5", "output could not be written, or the font DejaVu Sans is not installed"}}),
          [options, &common] { return figure(*options, common); }};
}

}  // namespace catoptric::app
