#include "gl/doctor.h"

#include <fmt/core.h>

#include <algorithm>

#include "config/json.h"
#include "config/json_text.h"
#include "core/clock.h"
#include "gl/context_state.h"
#include "gl/platform.h"
#include "gl/probe.h"

namespace catoptric::gl {
namespace {

std::vector<std::pair<std::string, std::string>> limitRows(const DeviceInfo& info) {
  const Limits& l = info.limits;
  return {
      {"texture size", std::to_string(l.maxTextureSize)},
      {"texture layers", std::to_string(l.maxArrayLayers)},
      {"cube map size", std::to_string(l.maxCubeMapSize)},
      {"texel buffer texels", std::to_string(l.maxTextureBufferTexels)},
      {"storage buffer bytes", std::to_string(l.maxStorageBufferBytes)},
      {"storage buffers", std::to_string(l.maxStorageBufferBindings)},
      {"uniform block bytes", std::to_string(l.maxUniformBlockBytes)},
      {"colour attachments", std::to_string(l.maxColorAttachments)},
      {"viewports", std::to_string(l.maxViewports)},
      {"viewport size", std::to_string(l.maxViewportSize)},
      {"texture units", std::to_string(l.maxTextureUnits)},
      {"compute invocations", std::to_string(l.maxComputeInvocations)},
      {"timer", info.timer == TimerKind::FinishClock ? "glFinish and clock" : "timer queries"},
  };
}

// Extensions that some methods use when they are there.
constexpr const char* kWelcomeExtensions[] = {"GL_ARB_shader_draw_parameters",
                                              "GL_ARB_indirect_parameters",
                                              "GL_ARB_texture_filter_anisotropic"};

/// The device's report but for `device` and `seconds`. Throws PlatformFailure.
DeviceReport usableReport(Platform platform, int index) {
  DeviceReport report;
  const ProbedDevice probed = probeDevice(platform, index);
  report.status = probed.info.software ? "software" : "ok";
  report.glVersion = probed.info.version;
  report.renderer = probed.info.renderer;
  report.limits = limitRows(probed.info);
  for (const char* extension : kWelcomeExtensions)
    if (!probed.extensions.contains(extension)) report.missing.emplace_back(extension);
  return report;
}

/// The inverse of deviceJson() for usableReport().
DeviceReport parseReport(const std::string& json) {
  const config::Value value = config::parseText(json, "a device's report");
  DeviceReport report;
  report.status = value.get("status").asString();
  report.glVersion = value.get("gl_version").asString();
  report.renderer = value.get("renderer").asString();
  for (const std::string& name : value.get("limits").keys())
    report.limits.emplace_back(name, value.get("limits").get(name).asString());
  for (const config::Value& name : value.get("missing").asArray())
    report.missing.push_back(name.asString());
  return report;
}

DeviceReport tryDevice(Platform platform, int index) {
  DeviceReport report;
  const std::int64_t start = nowNs();
  try {
    report = parseReport(inChild([&] { return deviceJson(usableReport(platform, index)); }));
  } catch (const PlatformFailure& failure) {
    report.status = "unusable";
    report.message = failure.message;
    report.whatToDo = failure.whatToDo;
  }
  report.device = DeviceChoice{false, platform, index}.text();
  report.seconds = secondsSince(start);
  return report;
}

}  // namespace

std::vector<DeviceReport> describeDevices() {
  std::vector<DeviceReport> reports;

  // EGL's devices, or one entry that says why there are none.
  int count = 0;
  try {
    count = std::stoi(inChild([] { return std::to_string(listEglDevices().size()); }));
  } catch (const PlatformFailure&) {
  }
  for (int index = 0; index < std::max(count, 1); ++index)
    reports.push_back(tryDevice(Platform::EglDevice, index));
  reports.push_back(tryDevice(Platform::EglSurfaceless, 0));
  reports.push_back(tryDevice(Platform::OsMesa, 0));
  return reports;
}

std::string deviceJson(const DeviceReport& report) {
  config::JsonText limits;
  for (const auto& [name, value] : report.limits) limits.add(name, value);
  return config::JsonText()
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

std::string doctorText(const std::vector<DeviceReport>& reports) {
  std::string text;
  for (const DeviceReport& report : reports) {
    text += report.device + ": " + report.status + "\n";
    if (report.usable()) {
      text += "  OpenGL    " + report.glVersion + "\n";
      text += "  renderer  " + report.renderer + "\n";
      text += fmt::format("  ready in  {:.3f} s\n", report.seconds);
      for (const auto& [name, value] : report.limits) {
        text += "  " + name + ": " + value + "\n";
      }
      for (const std::string& name : report.missing) text += "  without " + name + "\n";
    } else {
      text += "  problem   " + report.message + "\n";
      text += "  to do     " + report.whatToDo + "\n";
    }
  }
  return text;
}

}  // namespace catoptric::gl
