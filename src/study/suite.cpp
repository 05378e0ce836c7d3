#include "study/suite.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <set>
#include <span>

#include "config/fields.h"
#include "config/json_text.h"
#include "config/patch.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"
#include "study/suite_pictures.h"

namespace catoptric::study {
namespace {

using config::FieldType, config::Schema, config::Value;
namespace fields = config::fields;

const Schema& runSchema() {
  static const Schema schema = runSchemaOfSuite(
      {fields::object("frames", "Frames by effort: smoke, quick, full."),
       fields::of(FieldType::Array, "scene_patch",
                  "Changes of the scene's description: a JSON patch (RFC 6902)."),
       fields::of(FieldType::Array, "path_patch", "Changes of the path's description, likewise."),
       fields::boolean("times", "false: only errors and counters, each frame once.", ""),
       fields::boolean("may_refuse", "true: methods that do not support the scene are left out.",
                       "")});
  return schema;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

const std::vector<std::string>& functions() {
  static const std::vector<std::string> names{
      "ms",      "worst_ms", "first_ms", "mean_ms",       "memory_mb",
      "step",    "ratio",    "error",    "worst",         "mean",
      "most",    "percent",  "per",      "spread",        "median",
      "first",   "error_of", "slope",    "reflection_ms", "reflection_ratio",
      "refused", "front",    "take"};
  return names;
}

/// "name(a, b)" in its parts; no parts: it is no call.
struct Call {
  std::string name;
  std::vector<std::string> arguments;
};
Call parseCall(const std::string& text) {
  const std::size_t open = text.find('(');
  if (open == std::string::npos || open == 0 || text.back() != ')') return {};
  Call call{text.substr(0, open), {}};
  if (std::ranges::find(functions(), call.name) == functions().end()) return {};
  const std::string inside = text.substr(open + 1, text.size() - open - 2);
  for (std::size_t begin = 0; begin <= inside.size();) {
    const std::size_t end = std::min(inside.find(',', begin), inside.size());
    std::string part = inside.substr(begin, end - begin);
    part.erase(0, part.find_first_not_of(' '));
    part.erase(part.find_last_not_of(' ') + 1);
    call.arguments.push_back(part);
    begin = end + 1;
  }
  return call;
}

bool isRatio(const std::string& name) {
  return name == "ratio" || name == "reflection_ratio";
}

/// Functions that compare all methods of a run.
bool isChoice(const std::string& name) {
  return name == "front" || name == "take";
}

/// The time that a function of times takes.
TimeKind timeOf(const std::string& name) {
  return {Clock::Wall,
          name.starts_with("reflection") ? TimeKind::Of::Reflection : TimeKind::Of::Steady};
}

/// Functions of a value of each frame.
bool takesFrames(const std::string& name) {
  return name == "spread" || name == "median" || name == "first";
}

/// The names of a sum "a + b".
std::vector<std::string> termsOf(const std::string& sum) {
  std::vector<std::string> terms;
  for (std::size_t begin = 0; begin < sum.size();) {
    const std::size_t end = std::min(sum.find(" + ", begin), sum.size());
    terms.push_back(sum.substr(begin, end - begin));
    begin = end + 3;
  }
  return terms;
}

const Schema& suiteSchema() {
  static const Schema schema{
      .name = "suite",
      .help = "Tables and curves of a paper.",
      .fields = {
          fields::any("$schema", "For editors; not read."), fields::any("comment", "Not read."),
          fields::required(fields::text("title", "Title.")),
          fields::text("text", "Text below the title."),
          fields::required(fields::object("runs", "Runs by name.")),
          fields::object("efforts", "Settings of all runs, by effort."),
          fields::of(FieldType::Array, "checks", "Ranges that values must be in, for --check."),
          fields::of(FieldType::Array, "tables", "Tables."),
          fields::of(FieldType::Array, "figures", "Curves."),
          fields::of(FieldType::Array, "pictures",
                     "Frames of runs side by side, for --pictures.")}};
  return schema;
}

}  // namespace

std::string suiteJsonSchema() {
  return jsonSchemaOfSuite(suiteSchema(), "runs", runSchema());
}

std::string threeDigits(double value) {
  if (!std::isfinite(value)) return "";
  if (value == 0.0) return "0";
  const int digits = 2 - static_cast<int>(std::floor(std::log10(std::abs(value))));
  return report::fixedText(value, std::max(0, digits));
}

Suite readSuite(const std::filesystem::path& file) {
  const Value root = config::parseFile(file);
  config::require(root, suiteSchema());
  Suite suite;
  suite.title = root.get("title").asString();
  if (root.has("text")) suite.text = root.get("text").asString();
  for (const std::string& name : root.get("runs").keys()) {
    const Value value = root.get("runs").get(name);
    config::require(value, runSchema());
    SuiteRun run{readRunOfSuite(name, value, file.parent_path())};
    if (value.has("times")) run.times = value.get("times").asBool();
    if (value.has("may_refuse")) run.mayRefuse = value.get("may_refuse").asBool();
    run.scenePatch = value.get("scene_patch");
    run.pathPatch = value.get("path_patch");
    run.stated = config::without(value, {"methods", "frames"}).dump();
    suite.runs.push_back(std::move(run));
  }
  if (root.has("efforts"))
    for (const std::string& effort : root.get("efforts").keys())
      suite.efforts[effort] = readSettings(root.get("efforts").get(effort), file.parent_path());
  suite.checks = root.get("checks");
  if (root.has("tables")) suite.tables = expandedTables(root.get("tables").asArray(), suite.runs);
  if (root.has("figures")) suite.figures = root.get("figures").asArray();
  suite.pictures = root.get("pictures");
  return suite;
}

Settings settingsOf(const SuiteRun& run, const Settings& ofEffort,
                    const std::filesystem::path& folder) {
  Settings settings = run.settings;
  settings.insert(settings.end(), ofEffort.begin(), ofEffort.end());
  if (std::ranges::any_of(ofEffort, [](const auto& one) { return one.first == "scene"; }))
    return settings;
  for (const auto& [name, patch] :
       {std::pair<std::string, const Value&>{"scene", run.scenePatch}, {"path", run.pathPatch}}) {
    if (patch.isNull()) continue;
    const auto own = std::ranges::find(settings, name, &Settings::value_type::first);
    const std::filesystem::path file = std::filesystem::absolute(
        own != settings.end()
            ? std::filesystem::path(own->second)
            : run.config.parent_path() / config::parseFile(run.config).get(name).asString());
    std::filesystem::create_directories(folder);
    for (const auto& beside : std::filesystem::directory_iterator(file.parent_path())) {
      const std::filesystem::path link = folder / beside.path().filename();
      if (beside.is_directory() && !std::filesystem::exists(link))
        std::filesystem::create_directory_symlink(beside.path(), link);
    }
    const std::filesystem::path changed = folder / (run.name + "." + name + ".json");
    writeFileAtomically(changed, std::string_view(config::patched(config::parseFile(file), patch)));
    settings.emplace_back(name, changed.string());
  }
  return settings;
}

const SuiteData::Entry& SuiteData::entry(const std::string& name, const Value& cell) const {
  const std::size_t dot = name.find('.');
  const std::string run = name.substr(0, dot);
  const std::string method = dot == std::string::npos ? "" : name.substr(dot + 1);
  const auto found = runs.find(run);
  std::vector<std::string> names;
  for (const auto& [own, methods] : runs) names.push_back(own);
  if (found == runs.end())
    cell.fail("\"" + run + "\" is not a run of this suite" + didYouMean(run, names) + "; it has " +
              joined(names, ", "));
  const auto at = found->second.find(method);
  names.clear();
  for (const auto& [own, ignored] : found->second) names.push_back(own);
  if (at == found->second.end())
    cell.fail("the run " + run + " has no method \"" + method + "\"" + didYouMean(method, names) +
              "; it has " + joined(names, ", "));
  return at->second;
}

double SuiteData::number(const Value& cell) const {
  if (cell.kind() == Value::Kind::Number) return cell.asNumber();
  const Call call = parseCall(cell.asString());
  if (call.name.empty())
    cell.fail(
        cell.dump() +
        " is not a value; allowed: ms(R), worst_ms(R), first_ms(R), mean_ms(R), memory_mb(R), "
        "step(R, NAME), ratio(R, R), reflection_ms(R), reflection_ratio(R, R), front(R, TIME), "
        "take(R, MOST), refused(R), error(R, MEASURE), worst(R, MEASURE), mean(R, COUNTER), "
        "most(R, COUNTER), per(R, COUNTER, COUNTER), percent(R, COUNTER, COUNTER), error_of(R, "
        "OBJECT), slope(FIGURE, SERIES), and over the frames median(F, R, ...), first(F, "
        "R, ...), spread(F, R, ...) (mean / most) of F ms, step, ratio, error, mean or percent, "
        "where R is RUN.METHOD, a counter `samples` is the frame's own, and step, per and percent "
        "take sums, NAME + NAME");
  if (const auto known = stored.find(cell.asString()); known != stored.end())
    return known->second.number;
  if (call.name == "slope") return slopeOf(call.arguments, cell);
  if (takesFrames(call.name)) {
    const std::vector<double> values = valuesOf(call.arguments, cell);
    if (values.empty()) return NAN;
    if (call.name != "spread") return call.name == "first" ? values.front() : median(values);
    return number(config::parseText(
        config::jsonString(call.arguments[0] + "(" +
                           joined(std::span(call.arguments).subspan(1), ", ") + ")"),
        cell.place().text()));
  }
  if (call.name == "front") return front(call.arguments, cell).number;
  if (call.name == "take") return take(call.arguments, cell).number;
  const bool takesOne =
      call.name.ends_with("ms") || call.name == "memory_mb" || call.name == "refused";
  const std::size_t arguments = takesOne ? 1 : call.name == "percent" || call.name == "per" ? 3 : 2;
  if (call.arguments.size() != arguments)
    cell.fail(call.name + " takes " + std::to_string(arguments) + " arguments");
  const Entry& one = entry(call.arguments[0], cell);
  if (call.name == "refused") return one.refused.empty() ? 0.0 : 1.0;
  if (!one.refused.empty()) return NAN;
  if (call.name == "error" || call.name == "worst") {
    requireMetric(call.arguments[1]);
    if (call.name == "error") return one.errors.pooled(call.arguments[1], one.frames);
    const int worst = one.errors.worstFrame(call.arguments[1], one.frames);
    return worst > 0 ? one.errors.frames.at(worst).metrics.at(call.arguments[1]) : NAN;
  }
  if (call.name == "percent" || call.name == "per")
    return (call.name == "percent" ? 100.0 : 1.0) *
           perCounter(one, call.arguments[1], call.arguments[2], one.frames);
  if (call.name == "error_of") return errorOf(one, call.arguments[1], cell);
  if (call.name == "mean") return one.errors.meanCounter(call.arguments[1], one.frames);
  if (call.name == "most") {
    double most = 0.0;
    for (const int frame : one.frames)
      most = std::max(most, one.errors.meanCounter(call.arguments[1], {frame}));
    return most;
  }
  if (one.samples == nullptr) return NAN;
  const Measurement& measurement = one.samples->measurement;
  if (call.name == "ms" || call.name == "reflection_ms")
    return 1e3 * frameSeconds(measurement.times(one.index, timeOf(call.name))).mean;
  if (call.name == "first_ms" || call.name == "mean_ms") {
    const auto of = call.name == "first_ms" ? TimeKind::Of::First : TimeKind::Of::Mean;
    const double seconds = measurement.seconds(one.index, {Clock::Wall, of, one.amortize});
    return seconds > 0.0 ? 1e3 * seconds : NAN;
  }
  if (call.name == "memory_mb")
    return 1e-6 * static_cast<double>(measurement.memoryBytes(one.index));
  if (call.name == "worst_ms") return 1e3 * frameSeconds(measurement.times(one.index)).worst;
  if (call.name == "step") return 1e3 * mean(stepSeconds(one, call.arguments[1]));
  requireTurns(call.arguments[0], call.arguments[1], cell);
  const Entry& base = entry(call.arguments[1], cell);
  if (base.samples == nullptr) return NAN;
  return ratioOf(one, base, timeOf(call.name)).value;
}

/// The value of each frame, of "ms, R" and so on: what spread, median and first take.
std::vector<double> SuiteData::valuesOf(const std::vector<std::string>& arguments,
                                        const Value& cell) const {
  static const std::map<std::string, std::size_t> known{{"ms", 2},   {"step", 3},  {"error", 3},
                                                        {"mean", 3}, {"ratio", 3}, {"percent", 4}};
  const auto found = arguments.empty() ? known.end() : known.find(arguments[0]);
  if (found == known.end() || arguments.size() != found->second)
    cell.fail(
        "the arguments of spread, median and first must be ms, R; step, R, NAME; ratio, R, R; "
        "error, R, MEASURE; mean, R, COUNTER; or percent, R, COUNTER, COUNTER");
  const std::string& kind = arguments[0];
  const Entry& one = entry(arguments[1], cell);
  if (kind == "ms" || kind == "step" || kind == "ratio") {
    const auto seconds = [](const Entry& of, const std::string& steps) {
      return steps.empty() ? frameSeconds(of.samples->measurement.times(of.index)).frames
                           : stepSeconds(of, steps);
    };
    if (kind == "ratio") requireTurns(arguments[1], arguments[2], cell);
    const Entry& base = kind == "ratio" ? entry(arguments[2], cell) : one;
    if (one.samples == nullptr || base.samples == nullptr) return {};
    std::vector<double> values = seconds(one, kind == "step" ? arguments[2] : "");
    const std::vector<double> others = kind == "ratio" ? seconds(base, "") : values;
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = kind == "ratio" ? values[i] / others[i] : 1e3 * values[i];
    return values;
  }
  if (kind == "error") requireMetric(arguments[2]);
  std::vector<double> values;
  for (const int frame : one.frames)
    values.push_back(kind == "error" ? one.errors.pooled(arguments[2], {frame})
                     : kind == "mean"
                         ? one.errors.meanCounter(arguments[2], {frame})
                         : 100.0 * perCounter(one, arguments[2], arguments[3], {frame}));
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  return values;
}

/// Seconds of a step, or of a sum "a + b" of some, by frame.
std::vector<double> SuiteData::stepSeconds(const Entry& one, const std::string& steps) {
  std::vector<double> sums;
  for (const std::string& step : termsOf(steps)) {
    const std::vector<double> seconds =
        frameSeconds(one.samples->measurement.stepTimes(one.index, step)).frames;
    sums.resize(std::max(sums.size(), seconds.size()));
    for (std::size_t i = 0; i < seconds.size(); ++i) sums[i] += seconds[i];
  }
  return sums;
}

/// The slope of log y over log x of a figure's series, by least squares: "1, second_order".
double SuiteData::slopeOf(const std::vector<std::string>& arguments, const Value& cell) const {
  const std::size_t count = figures.size();
  const int index = arguments.empty() ? 0 : std::atoi(arguments[0].c_str());
  if (arguments.size() != 2 || index < 1 || static_cast<std::size_t>(index) > count)
    cell.fail("slope takes the number of a figure, from 1 to " + std::to_string(count) +
              ", and the name of one of its series");
  const Value figure = figures[static_cast<std::size_t>(index - 1)];
  if (!figure.get("series").has(arguments[1]))
    cell.fail("figure " + arguments[0] + " has no series \"" + arguments[1] + "\"" +
              didYouMean(arguments[1], figure.get("series").keys()));
  const std::vector<Value> cells = figure.get("series").get(arguments[1]).asArray();
  const std::vector<Value> values = figure.get("values").asArray();
  if (values.size() != cells.size())
    cell.fail("the series \"" + arguments[1] + "\" has " + std::to_string(cells.size()) +
              " values, its figure " + std::to_string(values.size()));
  std::vector<double> xs;
  std::vector<double> ys;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].kind() == Value::Kind::String && parseCall(cells[i].asString()).name == "slope")
      cell.fail("the series \"" + arguments[1] + "\" has a slope among its values");
    xs.push_back(std::log(values[i].asNumber()));
    ys.push_back(std::log(number(cells[i])));
  }
  const double x = mean(xs);
  const double y = mean(ys);
  double above = 0.0;
  double below = 0.0;
  for (std::size_t i = 0; i < xs.size(); ++i) {
    above += (xs[i] - x) * (ys[i] - y);
    below += (xs[i] - x) * (xs[i] - x);
  }
  return above / below;
}

/// A counter over another one, or over a sum "a + b" of some.
double SuiteData::perCounter(const Entry& one, const std::string& counter, const std::string& other,
                             const std::vector<int>& frames) {
  const methods::RunSettings& image = one.setting.run.image;
  const double samples =
      static_cast<double>(image.width) * image.height * image.samples * image.samples;
  const auto counted = [&](const std::string& sum) {
    double all = 0.0;
    for (const std::string& name : termsOf(sum))
      all += name == "samples"  ? samples
             : name == "frames" ? 1.0
                                : one.errors.meanCounter(name, frames);
    return all;
  };
  return counted(counter) / counted(other);
}

/// Mean difference over the pixels of the objects of one name.
double SuiteData::errorOf(const Entry& one, const std::string& object, const Value& cell) const {
  double sum = 0.0;
  double pixels = 0.0;
  bool any = one.reflectors.empty() || otherScenes;  // not measured yet
  for (const auto& [id, name] : one.reflectors) {
    if (name != object) continue;
    any = true;
    for (const int number : one.frames) {
      const auto frame = one.errors.frames.find(number);
      if (frame == one.errors.frames.end()) return NAN;
      const auto part = frame->second.objects.find(id);
      if (part == frame->second.objects.end()) continue;
      sum += static_cast<double>(part->second.sum8);
      pixels += static_cast<double>(part->second.pixels);
    }
  }
  if (!any) cell.fail("the scene has no reflector \"" + object + "\"");
  return sum / (3.0 * pixels);
}

/// Times of two runs are not measured in turns.
void SuiteData::requireTurns(const std::string& one, const std::string& other, const Value& cell) {
  if (one.substr(0, one.find('.')) != other.substr(0, other.find('.')))
    cell.fail(one + " and " + other +
              " are not measured in turns; a ratio needs two methods of "
              "one run");
}

/// Measured beside each other, or both beside the run's first setting.
Ratio SuiteData::ratioOf(const Entry& one, const Entry& other, const TimeKind& kind) {
  const auto against = [&](const Entry& entry, const std::string& key) {
    const Measurement& measurement = entry.samples->measurement;
    return pairedRatio(measurement.times(entry.index, kind),
                       measurement.times(*entry.samples->find(key), kind));
  };
  if (one.samples->find(other.setting.key)) return against(one, other.setting.key);
  return quotient(against(one, one.base), against(other, one.base));
}

std::string SuiteData::cell(const Value& cell) const {
  if (cell.kind() == Value::Kind::Number) return threeDigits(cell.asNumber());
  const std::string& text = cell.asString();
  const Call call = parseCall(text);
  if (call.name.empty()) {
    // "speed(a.b)" is meant to be a value, "18 (25, 13)" is not
    const std::size_t name = text.find_first_not_of("abcdefghijklmnopqrstuvwxyz_");
    if (name > 0 && name < text.size() && text[name] == '(' && text.back() == ')')
      cell.fail("no function \"" + text.substr(0, name) + "\"" +
                didYouMean(text.substr(0, name), functions()) + "; there are " +
                joined(functions(), ", "));
    return text;
  }
  if (const auto known = stored.find(text); known != stored.end()) return known->second.text;
  if (call.name == "spread") {
    const std::vector<double> values = valuesOf(call.arguments, cell);
    if (values.empty()) return "";
    return threeDigits(number(cell)) + " / " + threeDigits(*std::ranges::max_element(values));
  }
  if (call.name == "refused") return entry(call.arguments.at(0), cell).refused;
  if (call.name == "front") return front(call.arguments, cell).text;
  if (call.name == "take") return take(call.arguments, cell).text;
  if (isRatio(call.name)) {
    const Entry& one = entry(call.arguments.at(0), cell);
    const Entry& base = entry(call.arguments.size() > 1 ? call.arguments[1] : "", cell);
    requireTurns(call.arguments.at(0), call.arguments.at(1), cell);
    if (one.samples != nullptr && base.samples != nullptr)
      return ratioText(ratioOf(one, base, timeOf(call.name)));
  }
  return threeDigits(number(cell));
}

Suite withTablesAlone(Suite suite, const std::vector<int>& numbers) {
  std::vector<Value> tables;
  std::set<std::size_t> figures;
  for (std::size_t t = 0; t < suite.tables.size(); ++t) {
    if (std::ranges::find(numbers, static_cast<int>(t + 1)) == numbers.end()) continue;
    tables.push_back(suite.tables[t]);
    for (const Value& row : suite.tables[t].get("rows").asArray())
      for (const Value& cell : row.asArray()) {
        if (cell.kind() != Value::Kind::String) continue;
        const Call call = parseCall(cell.asString());
        const int figure = call.name == "slope" ? std::atoi(call.arguments.at(0).c_str()) : 0;
        if (figure > 0) figures.insert(static_cast<std::size_t>(figure - 1));
      }
  }
  for (const int number : numbers)
    if (number < 1 || static_cast<std::size_t>(number) > suite.tables.size())
      throw UsageError("--only " + std::to_string(number) + ": the suite has " +
                       std::to_string(suite.tables.size()) + " tables");
  suite.tables = std::move(tables);
  std::vector<Value> curves;
  for (const std::size_t figure : figures)
    if (figure < suite.figures.size()) curves.push_back(suite.figures[figure]);
  suite.figures = std::move(curves);
  suite.checks = Value();
  suite.pictures = Value();
  return suite;
}

std::vector<std::string> callsOf(const Suite& suite) {
  std::set<std::string> calls;
  const auto add = [&](const Value& cell) {
    if (cell.kind() != Value::Kind::String) return;
    const std::string name = parseCall(cell.asString()).name;
    // A slope is made of a figure's cells
    if (!name.empty() && name != "slope") calls.insert(cell.asString());
  };
  const auto each = [](const Value& list) {
    return list.isNull() ? std::vector<Value>{} : list.asArray();
  };
  for (const Value& table : suite.tables)
    for (const Value& row : each(table.get("rows")))
      for (const Value& cell : each(row)) add(cell);
  for (const Value& figure : suite.figures)
    for (const std::string& name :
         figure.has("series") ? figure.get("series").keys() : std::vector<std::string>{})
      for (const Value& cell : each(figure.get("series").get(name))) add(cell);
  for (const Value& check : each(suite.checks)) add(check.get("value"));
  for (const std::string& cell : cellsOfLabels(suite))
    add(config::parseText(config::jsonString(cell), "a label"));
  return {calls.begin(), calls.end()};
}

std::vector<std::pair<std::string, std::string>> methodsOfCell(const std::string& cell) {
  const Call call = parseCall(cell);
  const std::size_t first = takesFrames(call.name) ? 1 : 0;
  std::vector<std::pair<std::string, std::string>> methods;
  for (std::size_t i = first; i < call.arguments.size(); ++i) {
    if (i > first && !isRatio(call.name) && call.arguments[0] != "ratio") break;
    const std::string& name = call.arguments[i];
    const std::size_t dot = std::min(name.find('.'), name.size());
    methods.emplace_back(name.substr(0, dot),
                         isChoice(call.name) ? "*" : name.substr(std::min(dot + 1, name.size())));
  }
  return methods;
}

std::vector<std::string> metricsOf(const Suite& suite, const std::string& run) {
  std::vector<std::string> asked;
  for (const std::string& cell : callsOf(suite)) {
    const auto methods = methodsOfCell(cell);
    if (std::ranges::none_of(methods, [&](const auto& one) { return one.first == run; })) continue;
    const Call call = parseCall(cell);
    if (isChoice(call.name)) asked.insert(asked.end(), {kChoiceMetric, kFlicker});
    std::ranges::copy_if(
        call.arguments, std::back_inserter(asked), [](const std::string& argument) {
          return std::ranges::find(metrics(), argument, &MetricInfo::name) != metrics().end();
        });
  }
  return asked;
}

std::vector<std::string> failedChecks(const Suite& suite, const SuiteData& data) {
  std::vector<std::string> failed;
  for (const Value& check : suite.checks.isNull() ? std::vector<Value>{} : suite.checks.asArray()) {
    const double value = data.number(check.get("value"));
    const double from = check.get("from").asNumber();
    const double to = check.get("to").asNumber();
    if (!(from <= value && value <= to))
      failed.push_back(check.get("value").asString() + " is " + threeDigits(value) + ", expected " +
                       threeDigits(from) + " to " + threeDigits(to));
  }
  return failed;
}

}  // namespace catoptric::study
