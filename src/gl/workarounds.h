// What is done only because of how some drivers behave: each by name, with its reason and an off
// switch, the environment variable CATOPTRIC_DISABLE_WORKAROUNDS=NAME,NAME. All are on by default.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace catoptric::gl {

enum class Workaround : std::uint8_t {
  SoftwareFinishClock,
  SoftwareFlushBatches,
  MesaOneClipDistance,
  MesaReleaseBeforeSwitch,
  MesaWidthWithoutCache,
};

struct WorkaroundInfo {
  Workaround workaround;
  const char* name;
  const char* reason;
};

/// In the order of the enumeration.
std::span<const WorkaroundInfo> workarounds();

/// Whether it is on. Throws UsageError at the first question of a process when the variable names
/// what there is not.
bool worksAround(Workaround workaround);

/// Those that a list of names, separated by commas, turns off. Throws UsageError.
std::vector<Workaround> parseWorkarounds(std::string_view names);

}  // namespace catoptric::gl
