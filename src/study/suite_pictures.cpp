#include "study/suite_pictures.h"

#include <algorithm>
#include <tuple>

#include "config/fields.h"
#include "config/json_text.h"
#include "core/hash.h"
#include "core/text.h"
#include "study/stored.h"

namespace catoptric::study {
namespace {

using config::Field, config::FieldType, config::Schema, config::Value;
namespace fields = config::fields;

/// What a panel may say; a picture says it for all of its panels.
std::vector<Field> panelFields(std::vector<Field> more) {
  std::vector<Field> all{
      fields::of(FieldType::Integer, "frame", "The frame's number.", "", 1),
      fields::text("against", "METHOD or RUN.METHOD of {error}."),
      fields::choice("errors", "Of which pixels.", "", {"frame", "reflective"}),
      fields::text("layer", "A layer instead of the colours."),
      fields::text("mask", "Pixels of mask.NAME are red."),
      fields::of(FieldType::Integer, "difference", "That from `against`, times this.", "", 1, 255),
      fields::numbers("crop", "x, y, width, height in pixels."),
      fields::of(FieldType::Integer, "zoom", "Pixels become squares.", "", 1, 64),
      fields::of(FieldType::Integer, "width", "Pixels, at most.", "", 1),
      fields::text("label", "With {error} and {CELL}.")};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

const Schema& panelSchema() {
  static const Schema schema{
      .name = "panel",
      .help = "",
      .fields = panelFields({fields::required(fields::text("of", "RUN.METHOD"))})};
  return schema;
}

const Schema& pictureSchema() {
  static const Schema schema{
      .name = "picture",
      .help = "",
      .fields =
          panelFields({fields::required(fields::text("file", "Its name.")),
                       fields::text("title", "A line above."),
                       fields::required(fields::of(FieldType::Array, "rows", "Of panels."))})};
  return schema;
}

/// "RUN.METHOD", or a method of `run`.
std::pair<std::string, std::string> runAndMethod(const Suite& suite, const Value& value,
                                                 const std::string& run) {
  const std::string& text = value.asString();
  const std::size_t dot = text.find('.');
  const std::string own = dot == std::string::npos ? run : text.substr(0, dot);
  std::vector<std::string> names;
  for (const SuiteRun& one : suite.runs) names.push_back(one.name);
  if (std::ranges::find(names, own) == names.end())
    value.fail("\"" + text + "\" is not a RUN.METHOD of this suite" + didYouMean(own, names));
  return {own, dot == std::string::npos ? text : text.substr(dot + 1)};
}

SuitePanel panelOf(const Suite& suite, const Value& picture, const Value& value) {
  const bool bare = value.kind() == Value::Kind::String;
  if (!bare) config::require(value, panelSchema());
  const auto get = [&](const char* name) {
    return !bare && value.has(name) ? value.get(name) : picture.get(name);
  };
  const auto text = [&](const char* name) {
    return get(name).isNull() ? std::string() : get(name).asString();
  };
  const auto number = [&](const char* name, int otherwise) {
    return get(name).isNull() ? otherwise : static_cast<int>(get(name).asInteger());
  };
  SuitePanel panel;
  std::tie(panel.run, panel.method) = runAndMethod(suite, bare ? value : value.get("of"), "");
  panel.frame = number("frame", 1);
  if (!get("against").isNull())
    std::tie(panel.againstRun, panel.againstMethod) =
        runAndMethod(suite, get("against"), panel.run);
  panel.reflective = text("errors") == "reflective";
  panel.shown.layer = text("layer");
  panel.shown.mask = text("mask");
  panel.shown.difference = number("difference", 0);
  panel.shown.zoom = number("zoom", 1);
  panel.shown.width = number("width", 0);
  if (!get("crop").isNull()) {
    const std::vector<float> crop = get("crop").asFloats(4);
    panel.shown.crop = {static_cast<int>(crop[0]), static_cast<int>(crop[1]),
                        static_cast<int>(crop[2]), static_cast<int>(crop[3])};
  }
  panel.label = text("label");
  if (panel.shown.difference > 0 && panel.againstRun.empty())
    value.fail("a difference needs \"against\"");
  return panel;
}

/// The parts of a label: text, {cell}, text, ...
std::vector<std::string> partsOf(const std::string& label) {
  std::vector<std::string> parts{""};
  for (const char letter : label)
    if (letter == '{' || letter == '}')
      parts.emplace_back();
    else
      parts.back() += letter;
  return parts;
}

}  // namespace

std::vector<SuitePicture> suitePictures(const Suite& suite) {
  std::vector<SuitePicture> pictures;
  for (const Value& value :
       suite.pictures.isNull() ? std::vector<Value>{} : suite.pictures.asArray()) {
    config::require(value, pictureSchema());
    SuitePicture picture{value.get("file").asString(), "", {}, value.dump()};
    if (value.has("title")) picture.title = value.get("title").asString();
    for (const Value& row : value.get("rows").asArray()) {
      picture.rows.emplace_back();
      for (const Value& panel : row.asArray())
        picture.rows.back().push_back(panelOf(suite, value, panel));
    }
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

NeededFrames framesOf(const SuitePicture& picture) {
  NeededFrames needed;
  for (const auto& row : picture.rows)
    for (const SuitePanel& panel : row) {
      needed[panel.run][panel.method].insert(panel.frame);
      if (!panel.againstRun.empty())
        needed[panel.againstRun][panel.againstMethod].insert(panel.frame);
    }
  return needed;
}

std::string printOfPicture(const SuitePicture& picture, StatedPrints& prints) {
  Fingerprint print;
  print.add(picture.stated);
  for (const auto& [run, methods] : framesOf(picture))
    for (const auto& [method, numbers] : methods)
      print.add(prints.of("ms(" + run + "." + method + ")"));
  return print.text();
}

report::Figure suiteFigure(
    const SuitePicture& picture, const SuiteData& data,
    const std::function<std::filesystem::path(const std::string&, const std::string&, int)>&
        fileOf) {
  report::Figure figure{picture.title, {}};
  for (const auto& row : picture.rows) {
    figure.rows.emplace_back();
    for (const SuitePanel& panel : row) {
      report::Shown shown = panel.shown;
      shown.frame = fileOf(panel.run, panel.method, panel.frame);
      if (!panel.againstRun.empty())
        shown.against = fileOf(panel.againstRun, panel.againstMethod, panel.frame);
      std::string label;
      const std::vector<std::string> parts = partsOf(panel.label);
      for (std::size_t i = 0; i < parts.size(); ++i)
        label += i % 2 == 0 ? parts[i]
                 : parts[i] == "error"
                     ? threeDigits(report::l1Of(shown.frame, shown.against, panel.reflective))
                     : data.cell(config::parseText(config::jsonString(parts[i]), picture.file));
      figure.rows.back().panels.push_back({label, report::pictureOf(shown)});
    }
  }
  return figure;
}

std::vector<std::string> cellsOfLabels(const Suite& suite) {
  std::vector<std::string> cells;
  for (const SuitePicture& picture : suitePictures(suite))
    for (const auto& row : picture.rows)
      for (const SuitePanel& panel : row) {
        const std::vector<std::string> parts = partsOf(panel.label);
        for (std::size_t i = 1; i < parts.size(); i += 2)
          if (parts[i] != "error") cells.push_back(parts[i]);
      }
  return cells;
}

}  // namespace catoptric::study
