// catoptric list: methods, steps, counters, scenes, paths, configs, shapes, devices; schemas.
#include <algorithm>
#include <filesystem>
#include <memory>

#include "app/commands.h"
#include "app/manual.h"
#include "app/method_descriptions.h"
#include "app/run_options.h"
#include "config/json_text.h"
#include "config/pages.h"
#include "core/text.h"
#include "gl/doctor.h"
#include "methods/contract/method.h"
#include "nightly/night_suite.h"
#include "run/config/run_config.h"
#include "run/config/schemas.h"
#include "run/stage/layers.h"
#include "run/stage/steps.h"
#include "scene/description/description.h"
#include "study/frame_errors.h"
#include "study/suite.h"

namespace catoptric::app {
namespace {

using config::JsonText;

struct Kind {
  const char* name;
  const char* meaning;
};
const std::vector<Kind> kKinds = {{"methods", "ways to render reflections"},
                                  {"options", "of runs and methods, as --set takes them"},
                                  {"steps", "timed parts of the work"},
                                  {"counters", "what frames count"},
                                  {"layers", "of frames, besides their colours"},
                                  {"metrics", "measures of error"},
                                  {"scenes", "that come with catoptric"},
                                  {"paths", "of cameras, likewise"},
                                  {"configs", "of runs, likewise"},
                                  {"shapes", "of objects in scenes"},
                                  {"devices", "that OpenGL can render on here"}};

/// Scenes, paths or configs in a folder, sorted.
std::vector<std::string> filesIn(const std::filesystem::path& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string extension = entry.path().extension().string();
    if (entry.is_regular_file(error) &&
        (extension == ".json" || extension == ".gltf" || extension == ".glb"))
      files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

struct Item {
  std::string name;
  std::string summary;
  std::string json = {};  ///< all that is known of it; empty: these two
};

using Methods = std::vector<const methods::MethodEntry*>;

/// A run config's settings, with the names that --set takes.
void addSettings(const config::Schema& schema, const std::string& before,
                 std::vector<Item>& items) {
  for (const config::Field& field : schema.fields) {
    if (field.object != nullptr && field.type == config::FieldType::Object)
      addSettings(*field.object, before + field.name + ".", items);
    else if (field.name != "methods" && field.name != "$schema" && field.name != "comment")
      items.push_back({before + field.name, config::fieldText(field)});
  }
}

/// What the methods of `shown` say of themselves. `common`: also what all methods have.
std::vector<Item> itemsOfMethods(const std::string& what, const Methods& shown, bool common) {
  std::vector<Item> items;
  if (what == "options" && common) addSettings(run::runSchema(), "", items);
  if (what == "steps" && common)
    for (const methods::StepInfo& step : run::pipelineSteps())
      items.push_back({step.name, step.when + ": " + step.meaning, stepJson(step)});
  if (what == "counters" && common)
    for (const methods::CounterInfo& counter : run::pipelineCounters())
      items.push_back({counter.name, counter.meaning, counterJson(counter)});
  if (what == "layers" && common)
    for (const methods::SampleLayerInfo& layer : run::frameLayers())
      items.push_back({layer.name, layer.meaning});
  for (const methods::MethodEntry* entry : shown) {
    if (what == "methods") items.push_back({entry->id, entry->summary, methodJson(*entry)});
    if (what == "options")
      for (const config::Field& field : entry->options.fields)
        items.push_back({"methods." + entry->id + "." + field.name, config::fieldText(field)});
    if (what == "steps")
      for (const methods::StepInfo& step : entry->steps)
        items.push_back(
            {step.name, entry->id + ", " + step.when + ": " + step.meaning, stepJson(step)});
    if (what == "counters")
      for (const methods::CounterInfo& counter : entry->counters)
        items.push_back({counter.name, entry->id + ": " + counter.meaning, counterJson(counter)});
    if (what == "layers")
      for (const methods::SampleLayerInfo& layer : entry->sampleLayers)
        items.push_back({layer.name, entry->id + ": " + layer.meaning});
  }
  return items;
}

std::vector<Item> itemsOf(const std::string& what, const Methods& shown, bool common) {
  std::vector<Item> items = itemsOfMethods(what, shown, common);
  if (what == "metrics") {
    for (const study::MetricInfo& metric : study::metrics())
      items.push_back({metric.name, metric.meaning});
  } else if (what == "shapes") {
    for (const std::string& shape : scene::shapeNames()) items.push_back({shape, ""});
  } else if (what == "devices") {
    for (const gl::DeviceReport& report : gl::describeDevices())
      items.push_back({report.device, report.status + ", " +
                                          (report.usable() ? report.renderer : report.message)});
  } else if (what == "scenes" || what == "paths" || what == "configs") {
    for (const std::filesystem::path& folder : dataFolders()) {
      for (const std::string& file : filesIn(folder / what)) items.push_back({file, ""});
      if (what == "configs")
        for (const std::string& file : filesIn(folder / "configs/papers"))
          if (!file.ends_with(".suite.json")) items.push_back({file, ""});
    }
  }
  return items;
}

/// What is asked for besides the lists.
struct Pages {
  std::string schema;
  std::string completion;
  bool man = false;
  bool markdown = false;
};

/// Files of these kinds have schemas.
std::vector<std::string> schemaNames() {
  std::vector<std::string> names = run::schemaNames();
  names.insert(names.end(), {"suite", "nightly"});
  return names;
}

std::string schemaText(const std::string& name, bool markdown) {
  const std::vector<std::string> names = markdown ? run::schemaNames() : schemaNames();
  if (std::ranges::find(names, name) == names.end())
    throw UsageError("--schema" + std::string(markdown ? " with --markdown" : "") + ": \"" + name +
                     "\" is not known" + didYouMean(name, names) +
                     "; allowed: " + joined(names, ", "));
  if (markdown) return run::schemaMarkdown(name, methods::registry());
  if (name == "suite") return study::suiteJsonSchema();
  if (name == "nightly") return nightly::suiteJsonSchema();
  return run::schemaJson(name, methods::registry());
}

/// The page that was asked for; empty: none was.
std::string pageOf(const std::vector<std::string>& chosen, const Pages& pages) {
  CommonOptions unused;
  if (pages.man) return manPage(makeProgram(unused));
  if (!pages.completion.empty()) return completion(makeProgram(unused), pages.completion);
  if (!pages.schema.empty()) return schemaText(pages.schema, pages.markdown);
  if (!pages.markdown) return "";
  if (chosen != std::vector<std::string>{"methods"})
    throw UsageError("--markdown needs --schema NAME, or `list methods` without other words");
  return methodsPage(methods::registry());
}

std::vector<std::string> kindNames() {
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.emplace_back(kind.name);
  return names;
}

/// The words of a command line: kinds, and the methods whose items are asked for.
struct Request {
  std::vector<std::string> kinds;
  Methods methods;
  bool allMethods = true;
};

Request requestOf(const std::vector<std::string>& words, bool everything) {
  const std::vector<std::string> known = kindNames();
  Request request;
  for (const std::string& word : words) {
    const methods::MethodEntry* const method = methods::findMethod(methods::registry(), word);
    if (method != nullptr)
      request.methods.push_back(method);
    else if (std::ranges::find(known, word) == known.end())
      throw UsageError("list: \"" + word + "\" is not known" + didYouMean(word, known) +
                       "; allowed: " + joined(known, ", ") + ", and names of methods");
    else
      request.kinds.push_back(word);
  }
  request.allMethods = request.methods.empty();
  if (request.allMethods)
    for (const methods::MethodEntry& entry : methods::registry()) request.methods.push_back(&entry);
  if (request.kinds.empty() && !request.allMethods)
    request.kinds = {"methods", "options", "steps", "counters", "layers"};
  // Devices take a while: only when asked for.
  if (request.kinds.empty() && everything) request.kinds.assign(known.begin(), known.end() - 1);
  return request;
}

/// Lines of names and summaries, in columns.
std::string textOf(const std::vector<Item>& items, const std::string& indent) {
  std::size_t widest = 0;
  for (const Item& item : items) widest = std::max(widest, item.name.size());
  std::string text;
  for (const Item& item : items) {
    text += indent + item.name;
    if (!item.summary.empty())
      text += std::string(widest + 2 - item.name.size(), ' ') + item.summary;
    text += "\n";
  }
  return text;
}

ExitCode list(const std::vector<std::string>& words, const CommonOptions& common) {
  const Request request = requestOf(words, common.json);
  JsonText json;
  std::string text;
  for (const std::string& kind : request.kinds) {
    const std::vector<Item> items = itemsOf(kind, request.methods, request.allMethods);
    std::vector<std::string> texts;
    for (const Item& item : items) {
      JsonText one;
      one.add("name", item.name);
      if (!item.summary.empty()) one.add("summary", item.summary);
      texts.push_back(item.json.empty() ? one.object() : item.json);
    }
    json.raw(kind, "[" + joined(texts, ",") + "]");
    if (request.kinds.size() > 1) text += kind + "\n";
    text += textOf(items, request.kinds.size() > 1 ? "  " : "");
  }
  if (request.kinds.empty()) {
    std::vector<Item> kinds;
    for (const Kind& kind : kKinds) kinds.push_back({kind.name, kind.meaning});
    text = textOf(kinds, "") + "For example: catoptric list options traced\n";
  }
  printData(common.json ? json.object() + "\n" : text);
  return ExitCode::Done;
}

}  // namespace

Command listCommand(CommonOptions& common) {
  struct ListOptions {
    std::vector<std::string> what;
    Pages pages;
  };
  const auto options = std::make_shared<ListOptions>();
  const Rows own = {
      option("what", options->what, "WHAT",
             "What to list: any of " + joined(kindNames(), ", ") +
                 "; of all methods, or of those that are named, too [only these words]"),
      option("--schema", options->pages.schema, "NAME",
             "Print instead the JSON Schema of one of " + joined(schemaNames(), ", ")),
      flag("--markdown", options->pages.markdown,
           "Print the schema (--schema), or the methods' steps and counters (list methods), as a "
           "Markdown page"),
      flag("--man", options->pages.man, "Print the program's manual page"),
      option("--completion", options->pages.completion, "SHELL",
             "Print a completion script for a shell: bash or zsh"),
  };
  return {
      "list",
      "List methods, their options and much more; or print a JSON Schema, the manual page, or a "
      "shell's completion script.",
      own + commonRows(common),
      "Examples:\n  catoptric list methods\n  catoptric list options traced\n"
      "  catoptric list --schema run > configs/schema/run.schema.json\n"
      "  . <(catoptric list --completion bash)\n",
      [options, &common] {
        const std::string page = pageOf(options->what, options->pages);
        if (page.empty()) return list(options->what, common);
        printData(page);
        return ExitCode::Done;
      }};
}

}  // namespace catoptric::app
