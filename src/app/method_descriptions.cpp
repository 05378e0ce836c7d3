#include "app/method_descriptions.h"

#include "config/json_text.h"
#include "core/text.h"
#include "run/stage/steps.h"

namespace catoptric::app {
namespace {

/// TestOptions::small for a run config: there other methods may fill what this one refuses.
std::string smallOptions(const methods::MethodEntry& entry) {
  std::string text = entry.tests.small;
  if (entry.refusesReflectors)
    text.insert(1, std::string(R"("unsupported": "environment_map")") + (text == "{}" ? "" : ", "));
  return text;
}

using config::JsonText;

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

std::string stepRows(const std::vector<methods::StepInfo>& steps) {
  std::string text = "| step | when | meaning |\n|---|---|---|\n";
  for (const methods::StepInfo& step : steps)
    text += "| `" + step.name + "` | " + step.when + " | " + step.meaning + kindNote(step.kind) +
            " |\n";
  return text;
}

std::string counterRows(const std::vector<methods::CounterInfo>& counters) {
  std::string text = "| counter | what is counted |\n|---|---|\n";
  for (const methods::CounterInfo& counter : counters)
    text += "| `" + counter.name + "` | " + counter.meaning +
            (counter.mustBeZero ? " (**must be 0**)" : "") +
            (counter.onlyWith.empty() ? "" : "; only there with " + counter.onlyWith) + " |\n";
  return text;
}

std::string section(const methods::MethodEntry& entry) {
  std::string text = "## " + entry.id + "\n\n" + entry.summary +
                     (entry.paper.empty() ? "" : " " + entry.paper) + "\n\n" +
                     stepRows(entry.steps) + "\n" + counterRows(entry.counters);
  for (const methods::TableInfo& table : entry.tables) {
    text += "\n`" + table.name + ".csv`: a row is " + table.meaning +
            ". After `frame` it has the columns:\n\n| column | type | meaning |\n|---|---|---|\n";
    for (const methods::Column& column : table.columns)
      text += "| `" + column.name + "` | " + methods::columnTypeName(column.type) + " | " +
              column.meaning + " |\n";
  }
  if (!entry.sampleLayers.empty()) text += "\n| layer | channel | meaning |\n|---|---|---|\n";
  for (const methods::SampleLayerInfo& layer : entry.sampleLayers)
    text += "| `" + layer.name + "` | `id." + layer.name + "` | " + layer.meaning + " |\n";
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

std::string methodsPage(const std::vector<methods::MethodEntry>& registry) {
  std::string text =
      "# What methods report\n\n"
      "Made by `catoptric list methods --markdown`; do not edit. `timings.csv` and the timing "
      "tables\n"
      "have a row for each step; `frames.jsonl` has each frame's counters. `start` is before the\n"
      "first frame, `frames` in frames, `beside` by the writers, beside rendering. A counter that\n"
      "must be 0 says that something is wrong or extreme: a test holds it at 0 for every scene.\n\n"
      "## The program itself\n\n" +
      stepRows(run::pipelineSteps()) + "\n" + counterRows(run::pipelineCounters());
  for (const methods::MethodEntry& entry : registry) text += "\n" + section(entry);
  return text;
}

}  // namespace catoptric::app
