// Workarounds for the behaviour of some drivers. Each has a name, a reason and an off switch: the
// environment variable CATOPTRIC_DISABLE_WORKAROUNDS=NAME,NAME. All are on by default.
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

/// Whether a workaround is on. The first call of a process throws UsageError for an unknown name.
bool worksAround(Workaround workaround);

/// The workarounds that a comma-separated list of names turns off. Throws UsageError.
std::vector<Workaround> parseWorkarounds(std::string_view names);

}  // namespace catoptric::gl
