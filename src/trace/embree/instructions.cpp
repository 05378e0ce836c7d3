#include "trace/embree/instructions.h"

#include <embree3/rtcore.h>

#include "trace/embree/trace_scene.h"

namespace catoptric::trace {
namespace {

std::string bestInstructions() {
  RTCDevice device = rtcNewDevice("start_threads=0");
  const auto native = [&](RTCDeviceProperty property) {
    return device != nullptr && rtcGetDeviceProperty(device, property) != 0;
  };
  const bool rays16 = native(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED);
  const bool rays8 = native(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED);
  if (device != nullptr) rtcReleaseDevice(device);
  if (rays16) return "avx512";
  if (rays8) return __builtin_cpu_supports("avx2") ? "avx2" : "avx";
  return __builtin_cpu_supports("sse4.2") ? "sse4.2" : "sse2";
}

}  // namespace

std::string embreeInstructions() {
  static const std::string best = bestInstructions();
  const std::string name = forcedEmbreeIsa("CATOPTRIC_EMBREE_ISA");
  return name.empty() ? best : name;
}

}  // namespace catoptric::trace
