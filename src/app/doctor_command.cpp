// catoptric doctor: what this machine can render with.
#include <filesystem>

#include "app/commands.h"
#include "config/json_text.h"
#include "core/file.h"
#include "core/text.h"
#include "gl/doctor.h"
#include "gl/workarounds.h"
#include "run/folder/machine.h"
#include "run/folder/plan.h"

namespace catoptric::app {
namespace {

using config::JsonText;

/// The folder of what is computed once and kept, and how large it has grown.
struct Cache {
  std::filesystem::path folder = cacheFolder();
  std::uint64_t files = 0;
  std::uint64_t bytes = 0;

  Cache() {
    std::error_code ignored;
    if (folder.empty()) return;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, ignored)) {
      if (!entry.is_regular_file(ignored)) continue;
      ++files;
      bytes += entry.file_size(ignored);
    }
  }
  std::string text() const {
    if (folder.empty())
      return "no cache: none of CATOPTRIC_CACHE, XDG_CACHE_HOME and HOME names a folder\n";
    return "cache: " + folder.string() + ", " + std::to_string(files) +
           (files == 1 ? " file, " : " files, ") + run::bytesText(bytes) +
           "; it may be deleted at any time\n";
  }
};

std::string workaroundsJson() {
  std::vector<std::string> texts;
  for (const gl::WorkaroundInfo& info : gl::workarounds()) {
    texts.push_back(JsonText()
                        .add("name", info.name)
                        .add("on", gl::worksAround(info.workaround))
                        .add("reason", info.reason)
                        .object());
  }
  return "[" + joined(texts, ",") + "]";
}

std::string workaroundsText() {
  std::string text =
      "Driver workarounds, off by CATOPTRIC_DISABLE_WORKAROUNDS=NAME,NAME in the environment:\n";
  for (const gl::WorkaroundInfo& info : gl::workarounds()) {
    text += std::string("  ") + info.name + (gl::worksAround(info.workaround) ? "" : " (off)") +
            ": " + info.reason + ".\n";
  }
  return text;
}

ExitCode doctor(const CommonOptions& common) {
  const std::vector<gl::DeviceReport> reports = gl::describeDevices();
  std::vector<std::string> usable;
  for (const gl::DeviceReport& report : reports)
    if (report.usable()) usable.push_back(report.device);
  const Cache cache;
  if (common.json) {
    std::vector<std::string> texts;
    for (const gl::DeviceReport& report : reports) texts.push_back(gl::deviceJson(report));
    printData(JsonText()
                  .raw("machine", run::machineJson())
                  .raw("devices", "[" + joined(texts, ",") + "]")
                  .raw("cache", JsonText()
                                    .add("folder", cache.folder.string())
                                    .add("files", cache.files)
                                    .add("bytes", cache.bytes)
                                    .object())
                  .raw("workarounds", workaroundsJson())
                  .object() +
              "\n");
  } else {
    printData("catoptric " + std::string(run::versionText()) + " on " + run::processorName() +
              "\n" + gl::doctorText(reports) + workaroundsText() + cache.text() +
              (usable.empty() ? "No device can render: see \"to do\" above.\n"
                              : "Ready to render: --device " + joined(usable, ", or ") + ".\n"));
  }
  return usable.empty() ? ExitCode::NoDevice : ExitCode::Done;
}

}  // namespace

Command doctorCommand(CommonOptions& common) {
  return {"doctor",
          "Try every OpenGL platform and device, and say what is missing and how to mend it.",
          commonRows(common), R"(Example:
  catoptric doctor

It also prints the folder of the cache, and its size.
)" + exitCodes({{"4", "no device can render"}}),
          [&common] { return doctor(common); }};
}

}  // namespace catoptric::app
