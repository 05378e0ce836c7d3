#include "core/vector_level.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <string>

#include "core/instruction_sets.h"

namespace catoptric {
namespace {

VectorLevel machineLevel() {
  __builtin_cpu_init();
  const bool v2 = __builtin_cpu_supports("ssse3") && __builtin_cpu_supports("sse4.1") &&
                  __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  if (!v2) return VectorLevel::Base;
  const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                  __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  if (!v3) return VectorLevel::V2;
  const bool v4 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                  __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
                  __builtin_cpu_supports("avx512cd");
  return v4 ? VectorLevel::V4 : VectorLevel::V3;
}

/// The machine's, or what the environment variable CATOPTRIC_VECTOR_LEVEL allows.
VectorLevel firstLevel() {
  constexpr std::array kNames{"base", "v2", "v3", "v4"};  // as VectorLevel counts them
  const std::string forced = forcedInstructionSet("CATOPTRIC_VECTOR_LEVEL", kNames);
  const auto place = std::ranges::find(kNames, forced);
  const auto wanted = static_cast<VectorLevel>(place - kNames.begin());
  return forced.empty() ? machineLevel() : std::min(wanted, machineLevel());
}

std::atomic<VectorLevel>& allowed() {
  static std::atomic<VectorLevel> level{firstLevel()};
  return level;
}

}  // namespace

VectorLevel vectorLevel() {
  return allowed().load(std::memory_order_relaxed);
}

void limitVectorLevel(VectorLevel level) {
  allowed() = std::min(level, machineLevel());
}

}  // namespace catoptric
