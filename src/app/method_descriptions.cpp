#include "app/method_descriptions.h"

#include <map>

#include "config/json_text.h"
#include "config/pages.h"
#include "core/text.h"
#include "run/config/run_config.h"
#include "run/stage/steps.h"

namespace catoptric::app {
namespace {

/// TestOptions::small for a run config: there other methods may fill what this one refuses.
std::string smallOptions(const methods::MethodEntry& entry) {
  std::string text = entry.tests.small;
  if (entry.refusesReflectors)
    text.insert(1, std::string(R"("unsupported": ")") + run::fallbackMethods().front() + "\"" +
                       (text == "{}" ? "" : ", "));
  return text;
}

using config::JsonText;

/// Where docs/methods.md describes what several methods report.
constexpr const char* kSeveral = "#several-methods";

/// "[a,b]" of the JSON texts that `text` makes.
template <class Item, class Text>
std::string listJson(const std::vector<Item>& items, Text&& text) {
  std::vector<std::string> texts;
  for (const Item& item : items) texts.push_back(text(item));
  return "[" + joined(texts, ",") + "]";
}

std::string tableJson(const methods::TableInfo& table) {
  return JsonText()
      .add("name", table.name)
      .add("meaning", table.meaning)
      .raw("columns", listJson(table.columns,
                               [](const methods::Column& column) {
                                 return JsonText()
                                     .add("name", column.name)
                                     .add("type", methods::columnTypeName(column.type))
                                     .add("meaning", column.meaning)
                                     .object();
                               }))
      .object();
}

std::string kindNote(methods::StepKind kind) {
  const bool apart = kind == methods::StepKind::Waiting || kind == methods::StepKind::Check;
  return apart ? " (not part of `rendering`)" : "";
}

std::string stepLine(const methods::StepInfo& step) {
  const std::string when = step.when == "frames" ? "" : " (" + step.when + ")";
  return "- `" + step.name + "`" + when + ": " + step.meaning + kindNote(step.kind) + "\n";
}

std::string counterLine(const methods::CounterInfo& counter) {
  return "- `" + counter.name + "`" + (counter.mustBeZero ? " (**must be 0**)" : "") + ": " +
         counter.meaning + (counter.onlyWith.empty() ? "" : "; only with " + counter.onlyWith) +
         "\n";
}

std::string tableText(const methods::TableInfo& table) {
  std::string text =
      "a row is " + table.meaning + ". Its columns after `frame` (integers unless marked):\n\n";
  for (const methods::Column& column : table.columns) {
    const bool marked = column.type != methods::ColumnType::Integer;
    text += "- `" + column.name + "`" +
            (marked ? std::string(" (") + methods::columnTypeName(column.type) + ")" : "") + ": " +
            column.meaning + "\n";
  }
  return text;
}

}  // namespace

std::string stepJson(const methods::StepInfo& step) {
  return JsonText()
      .add("name", step.name)
      .add("when", step.when)
      .add("meaning", step.meaning)
      .add("kind", methods::stepKindName(step.kind))
      .object();
}

std::string counterJson(const methods::CounterInfo& counter) {
  return JsonText()
      .add("name", counter.name)
      .add("meaning", counter.meaning)
      .add("must_be_zero", counter.mustBeZero)
      .add("only_with", counter.onlyWith)
      .object();
}

std::string methodJson(const methods::MethodEntry& entry) {
  const std::string tests =
      JsonText()
          .raw("small", smallOptions(entry))
          .raw("refracting", entry.tests.refracting)
          .raw("variants",
               listJson(entry.tests.variants, [](const std::string& options) { return options; }))
          .object();
  return JsonText()
      .add("name", entry.id)
      .raw("aliases",
           listJson(entry.aliases,
                    [](const methods::MethodAlias& alias) { return config::jsonString(alias.id); }))
      .add("summary", entry.summary)
      .add("paper", entry.paper)
      .raw("steps", listJson(entry.steps, stepJson))
      .raw("counters", listJson(entry.counters, counterJson))
      .raw("tables", listJson(entry.tables, tableJson))
      .raw("layers",
           listJson(
               entry.sampleLayers,
               [](const methods::SampleLayerInfo& layer) {
                 return JsonText().add("name", layer.name).add("meaning", layer.meaning).object();
               }))
      .raw("tests", tests)
      .object();
}

/// A paragraph with the method's paper and a link to the paper's page; empty without a paper.
std::string paperLink(const methods::MethodEntry& entry) {
  if (entry.paper.empty()) return "";
  const std::size_t space = entry.paper.find(' ');
  return "\n\nPaper: " + entry.paper.substr(0, space) + "(papers/" +
         (space == std::string::npos ? entry.id : entry.paper.substr(space + 1)) + ".md)";
}

std::string methodsPage(const std::vector<methods::MethodEntry>& registry) {
  std::string text =
      "# What methods report\n\n"
      "`catoptric list methods --markdown` prints this page. A **step** is a timed part of the "
      "work:\n`timings.csv` and the timing tables have a row for each. Steps run in each frame "
      "unless marked:\n`start` means before the first frame, `beside` in the writers' threads. A "
      "**counter** is a\nnumber in each frame's record in `frames.jsonl`. A counter that must be 0 "
      "reports a fault or\nan extreme scene.\n\n## Every method\n\nSteps:\n\n";
  for (const methods::StepInfo& step : run::pipelineSteps()) text += stepLine(step);
  text += "\nCounters:\n\n";
  for (const methods::CounterInfo& counter : run::pipelineCounters()) text += counterLine(counter);

  config::SharedLines steps;
  config::SharedLines counters;
  for (const methods::MethodEntry& entry : registry) {
    for (const methods::StepInfo& step : entry.steps) steps.add(entry.id, stepLine(step));
    for (const methods::CounterInfo& counter : entry.counters)
      counters.add(entry.id, counterLine(counter));
  }
  text += "\n## Several methods\n\n### Steps\n" + steps.shared() + "\n### Counters\n" +
          counters.shared();
  std::map<std::string, std::string> toldBy;
  for (const methods::MethodEntry& entry : registry) {
    text += "\n## " + entry.id + paperLink(entry) + "\n\nSteps:\n\n" +
            steps.of(entry.id, kSeveral) + "\nCounters:\n\n" + counters.of(entry.id, kSeveral);
    for (const methods::TableInfo& table : entry.tables) {
      const auto [told, isNew] = toldBy.try_emplace(tableText(table), entry.id);
      text += "\n`" + table.name + ".csv`: " +
              (isNew ? told->first : "as of [" + told->second + "](#" + told->second + ")\n");
    }
    if (!entry.sampleLayers.empty()) text += "\nLayers (channels `id.NAME`):\n\n";
    for (const methods::SampleLayerInfo& layer : entry.sampleLayers)
      text += "- `" + layer.name + "`: " + layer.meaning + "\n";
  }
  return text;
}

}  // namespace catoptric::app
