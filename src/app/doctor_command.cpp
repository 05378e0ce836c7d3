// catoptric doctor: what this machine can render with.
#include "app/commands.h"
#include "config/json_text.h"
#include "core/text.h"
#include "gl/doctor.h"
#include "run/folder/machine.h"

namespace catoptric::app {
namespace {

using config::JsonText;

std::string reportJson(const gl::DeviceReport& report) {
  JsonText limits;
  for (const auto& [name, value] : report.limits) limits.add(name, value);
  return JsonText()
      .add("device", report.device)
      .add("status", report.status)
      .add("gl_version", report.glVersion)
      .add("renderer", report.renderer)
      .raw("limits", limits.object())
      .add("missing", report.missing)
      .add("message", report.message)
      .add("what_to_do", report.whatToDo)
      .add("seconds", report.seconds)
      .object();
}

ExitCode doctor(const CommonOptions& common) {
  const std::vector<gl::DeviceReport> reports = gl::describeDevices();
  std::vector<std::string> usable;
  for (const gl::DeviceReport& report : reports)
    if (report.usable()) usable.push_back(report.device);
  if (common.json) {
    std::vector<std::string> texts;
    for (const gl::DeviceReport& report : reports) texts.push_back(reportJson(report));
    printData(JsonText()
                  .raw("machine", run::machineJson())
                  .raw("devices", "[" + joined(texts, ",") + "]")
                  .object() +
              "\n");
  } else {
    printData("catoptric " + std::string(run::versionText()) + " on " + run::processorName() +
              "\n" + gl::doctorText(reports) +
              (usable.empty() ? "No device can render: see \"to do\" above.\n"
                              : "Ready to render: --device " + joined(usable, ", or ") + ".\n"));
  }
  return usable.empty() ? ExitCode::NoDevice : ExitCode::Done;
}

}  // namespace

void addDoctor(CLI::App& program, CommonOptions& common, Action& action) {
  CLI::App* command = program.add_subcommand(
      "doctor", "Try every GL platform and device; say what is missing and what to do");
  addCommon(*command, common);
  command->callback([&common, &action] { action = [&common] { return doctor(common); }; });
}

}  // namespace catoptric::app
