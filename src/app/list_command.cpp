// catoptric list: methods, steps, counters, scenes, paths, configs, shapes, devices; schemas.
#include <algorithm>
#include <filesystem>
#include <memory>

#include "app/commands.h"
#include "app/manual.h"
#include "app/method_descriptions.h"
#include "app/run_options.h"
#include "config/json_text.h"
#include "core/text.h"
#include "gl/doctor.h"
#include "methods/contract/method.h"
#include "run/config/run_config.h"
#include "run/config/schemas.h"
#include "run/stage/steps.h"
#include "scene/description/description.h"

namespace catoptric::app {
namespace {

using config::JsonText;

const std::vector<std::string> kWhat = {"methods", "steps",   "counters", "scenes",
                                        "paths",   "configs", "shapes",   "devices"};

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

std::vector<Item> itemsOf(const std::string& what) {
  std::vector<Item> items;
  if (what == "methods") {
    for (const methods::MethodEntry& entry : methods::registry())
      items.push_back({entry.id, entry.summary, methodJson(entry)});
  } else if (what == "steps") {
    for (const methods::StepInfo& step : run::pipelineSteps())
      items.push_back({step.name, step.when + ": " + step.meaning, stepJson(step)});
    for (const methods::MethodEntry& entry : methods::registry())
      for (const methods::StepInfo& step : entry.steps)
        items.push_back(
            {step.name, entry.id + ", " + step.when + ": " + step.meaning, stepJson(step)});
  } else if (what == "counters") {
    for (const methods::CounterInfo& counter : run::pipelineCounters())
      items.push_back({counter.name, counter.meaning, counterJson(counter)});
    for (const methods::MethodEntry& entry : methods::registry())
      for (const methods::CounterInfo& counter : entry.counters)
        items.push_back({counter.name, entry.id + ": " + counter.meaning});
  } else if (what == "shapes") {
    for (const std::string& shape : scene::shapeNames()) items.push_back({shape, ""});
  } else if (what == "devices") {
    for (const gl::DeviceReport& report : gl::describeDevices())
      items.push_back({report.device, report.status + ", " +
                                          (report.usable() ? report.renderer : report.message)});
  } else {
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

/// The page that was asked for; empty: none was.
std::string pageOf(const std::vector<std::string>& chosen, const Pages& pages) {
  CommonOptions unused;
  if (pages.man) return manPage(makeProgram(unused));
  if (!pages.completion.empty()) return completion(makeProgram(unused), pages.completion);
  if (!pages.schema.empty())
    return pages.markdown ? run::schemaMarkdown(pages.schema, methods::registry())
                          : run::schemaJson(pages.schema, methods::registry());
  if (!pages.markdown) return "";
  if (chosen != std::vector<std::string>{"methods"})
    throw UsageError("--markdown needs --schema NAME, or `list methods` without other words");
  return methodsPage(methods::registry());
}

ExitCode list(const std::vector<std::string>& chosen, const CommonOptions& common) {
  for (const std::string& what : chosen)
    if (std::find(kWhat.begin(), kWhat.end(), what) == kWhat.end())
      throw UsageError("list: \"" + what + "\" is not known" + didYouMean(what, kWhat) +
                       "; allowed: " + joined(kWhat, ", "));
  // Devices take a while: only when asked for.
  const std::vector<std::string> all(kWhat.begin(), kWhat.end() - 1);
  const std::vector<std::string>& shown = chosen.empty() ? all : chosen;
  JsonText json;
  std::string text;
  for (const std::string& what : shown) {
    const std::vector<Item> items = itemsOf(what);
    std::size_t widest = 0;
    std::vector<std::string> texts;
    for (const Item& item : items) {
      widest = std::max(widest, item.name.size());
      JsonText one;
      one.add("name", item.name);
      if (!item.summary.empty()) one.add("summary", item.summary);
      texts.push_back(item.json.empty() ? one.object() : item.json);
    }
    json.raw(what, "[" + joined(texts, ",") + "]");
    if (shown.size() > 1) text += what + "\n";
    const std::string indent = shown.size() > 1 ? "  " : "";
    for (const Item& item : items) {
      text += indent + item.name;
      if (!item.summary.empty())
        text += std::string(widest + 2 - item.name.size(), ' ') + item.summary;
      text += "\n";
    }
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
             "What to list: any of " + joined(kWhat, ", ") + " [all but devices]"),
      option("--schema", options->pages.schema, "NAME",
             "Print instead the JSON Schema of one of " + joined(run::schemaNames(), ", ")),
      flag("--markdown", options->pages.markdown,
           "Print the schema (--schema), or the methods' steps and counters (list methods), as a "
           "Markdown page"),
      flag("--man", options->pages.man, "Print the program's manual page"),
      option("--completion", options->pages.completion, "SHELL",
             "Print a completion script for a shell: bash or zsh"),
  };
  return {"list",
          "List methods, steps, counters, scenes, paths, configs, shapes or devices; or print a "
          "JSON Schema, the manual page, or a shell's completion script.",
          own + commonRows(common),
          "Examples:\n  catoptric list methods\n  catoptric list devices\n"
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
