#include "study/stored.h"

#include <algorithm>
#include <cmath>

#include "config/json_text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/hash.h"
#include "run/config/run_config.h"

namespace catoptric::study {
namespace {

using config::Value;

const SuiteRun* runOf(const Suite& suite, const std::string& name) {
  const auto found =
      std::ranges::find_if(suite.runs, [&](const SuiteRun& run) { return run.name == name; });
  return found == suite.runs.end() ? nullptr : &*found;
}

/// A config's method as it is written; null: it has none of that name.
Value methodOf(const Value& config, const std::string& name) {
  for (const Value& method : config.get("methods").asArray())
    if (run::entryName(method) == name) return method;
  return {};
}

}  // namespace

const std::vector<std::string>& StatedPrints::stated(const std::string& name,
                                                     const std::string& method) {
  const auto [place, isNew] = stated_.try_emplace({name, method});
  std::vector<std::string>& texts = place->second;
  const SuiteRun* run = runOf(suite_, name);
  if (!isNew || run == nullptr) return texts;
  const auto [config, unread] = configs_.try_emplace(run->config);
  if (unread) config->second = config::parseFile(run->config);
  const Value entry =
      method == "*" ? config->second.get("methods") : methodOf(config->second, method);
  if (entry.isNull()) return texts;
  texts = {run->stated, config::without(config->second, {"comment", "$schema", "methods"}).dump(),
           entry.dump(), effort_};
  if (const auto frames = run->frames.find(effort_); frames != run->frames.end())
    texts.push_back(frames->second);
  if (const auto settings = suite_.efforts.find(effort_); settings != suite_.efforts.end())
    for (const auto& [key, value] : settings->second) texts.push_back(key + "=" + value);
  return texts;
}

std::string StatedPrints::of(const std::string& cell) {
  Fingerprint print;
  for (const auto& [run, method] : methodsOfCell(cell)) {
    const std::vector<std::string>& texts = stated(run, method);
    if (texts.empty()) return "";
    for (const std::string& text : texts) print.add(text);
  }
  return print.text();
}

StoredValues::StoredValues(const std::filesystem::path& file) : file_(file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return;
  const Value root = config::parseFile(file);
  const std::vector<Value> by = root.get("measured").asArray();
  if (root.has("pictures"))
    for (const std::string& name : root.get("pictures").keys())
      pictures_[name] = root.get("pictures").get(name).asString();
  const Value values = root.get("values");
  for (const std::string& cell : values.keys()) {
    const Value value = values.get(cell);
    const std::int64_t number = value.get("by").asInteger();
    if (number < 0 || number >= static_cast<std::int64_t>(by.size()))
      value.fail("\"by\" must be the number of a member of \"measured\", from 0");
    entries_[cell] = {
        {value.get("text").asString(), value.has("value") ? value.get("value").asNumber() : NAN},
        value.has("of") ? value.get("of").asString() : "",
        by[static_cast<std::size_t>(number)].asString()};
  }
}

std::map<std::string, SuiteData::Stored> StoredValues::fresh(const Suite& suite,
                                                             const std::string& effort) const {
  std::map<std::string, SuiteData::Stored> fresh;
  StatedPrints prints(suite, effort);
  for (const std::string& cell : callsOf(suite)) {
    const auto entry = entries_.find(cell);
    if (entry == entries_.end()) continue;
    const std::string of = prints.of(cell);
    // What somebody wrote into the file by hand has no fingerprint yet: it gets one
    const bool holds = entry->second.of.empty() || of == entry->second.of;
    if (!of.empty() && holds) fresh[cell] = entry->second.value;
  }
  return fresh;
}

void StoredValues::keep(const Suite& suite, const SuiteData& data, const std::string& effort,
                        const std::string& by) {
  std::map<std::string, Entry> kept;
  StatedPrints prints(suite, effort);
  for (const std::string& cell : callsOf(suite)) {
    const Value value = config::parseText(config::jsonString(cell), "cell");
    const bool known = data.stored.contains(cell);
    kept[cell] = {
        {data.cell(value), data.number(value)}, prints.of(cell), known ? entries_.at(cell).by : by};
  }
  entries_ = std::move(kept);
}

void StoredValues::write() const {
  std::vector<std::string> measured;
  std::string values;
  for (const auto& [cell, entry] : entries_) {
    const auto at = std::ranges::find(measured, entry.by);
    config::JsonText text;
    text.add("text", entry.value.text);
    if (std::isfinite(entry.value.number)) text.add("value", entry.value.number);
    text.add("of", entry.of).add("by", static_cast<int>(at - measured.begin()));
    values += (values.empty() ? "\n " : ",\n ") + config::jsonString(cell) + ": " + text.object();
    if (at == measured.end()) measured.push_back(entry.by);
  }
  std::string all;
  for (const std::string& by : measured)
    all += (all.empty() ? "\n " : ",\n ") + config::jsonString(by);
  std::string pictures;
  for (const auto& [name, of] : pictures_)
    pictures += (pictures.empty() ? ",\n\"pictures\": {\n " : ",\n ") + config::jsonString(name) +
                ": " + config::jsonString(of);
  if (!pictures.empty()) pictures += "}";
  writeFileAtomically(file_, std::string_view("{\"measured\": [" + all + "],\n\"values\": {" +
                                              values + "}" + pictures + "}\n"));
}

std::map<std::string, std::set<std::string>> neededMethods(
    const Suite& suite, const std::map<std::string, SuiteData::Stored>& fresh) {
  std::map<std::string, std::set<std::string>> needed;
  for (const std::string& cell : callsOf(suite))
    if (!fresh.contains(cell))
      for (const auto& [run, method] : methodsOfCell(cell)) needed[run].insert(method);
  return needed;
}

}  // namespace catoptric::study
