#include "gl/workarounds.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "core/error.h"
#include "core/text.h"

namespace catoptric::gl {
namespace {

constexpr const char* kVariable = "CATOPTRIC_DISABLE_WORKAROUNDS";

constexpr std::array<WorkaroundInfo, 5> kWorkarounds = {{
    {Workaround::SoftwareFinishClock, "software-finish-clock",
     "llvmpipe claims timer queries of 64 bits but takes its timestamps when commands are queued "
     "(a "
     "draw of 2,800 ms reads 8 to 20 ms): software renderers are timed by glFinish and the clock"},
    {Workaround::SoftwareFlushBatches, "software-flush-batches",
     "llvmpipe bins triangles on one thread and rasterizes on others, a batch at a time: a flush "
     "after so many triangles lets both work at once"},
    {Workaround::MesaOneClipDistance, "mesa-one-clip-distance",
     "llvmpipe (Mesa 22.3.6) clips by a distance that a shader writes even where no clip distance "
     "is enabled: one is always enabled where shaders write any"},
    {Workaround::MesaReleaseBeforeSwitch, "mesa-release-before-switch",
     "EGL and OSMesa share Mesa's state of the current context: a context is released before "
     "another becomes current"},
    {Workaround::MesaWidthWithoutCache, "mesa-width-without-cache",
     "Mesa 22.3.6 keys its shader cache by the processor but not by LP_NATIVE_VECTOR_WIDTH, and "
     "code for wider vectors overruns the heap: no cache is used where the variable is set"},
}};

}  // namespace

std::span<const WorkaroundInfo> workarounds() {
  return kWorkarounds;
}

std::vector<Workaround> parseWorkarounds(std::string_view names) {
  std::vector<Workaround> disabled;
  for (std::size_t start = 0; start <= names.size();) {
    const std::size_t end = std::min(names.find(',', start), names.size());
    const std::string name(names.substr(start, end - start));
    start = end + 1;
    if (name.empty()) continue;  // "a,,b", or a comma at an end
    const auto found = std::ranges::find_if(
        kWorkarounds, [&](const WorkaroundInfo& info) { return name == info.name; });
    if (found == kWorkarounds.end()) {
      std::vector<std::string> known;
      for (const WorkaroundInfo& info : kWorkarounds) known.emplace_back(info.name);
      throw UsageError(std::string(kVariable) + ": there is no driver workaround \"" + name + "\"" +
                       didYouMean(name, known) + "; there are: " + joined(known, ", "));
    }
    disabled.push_back(found->workaround);
  }
  return disabled;
}

bool worksAround(Workaround workaround) {
  static const std::vector<Workaround> disabled = [] {
    const char* names = std::getenv(kVariable);
    return parseWorkarounds(names != nullptr ? names : "");
  }();
  return std::ranges::find(disabled, workaround) == disabled.end();
}

}  // namespace catoptric::gl
