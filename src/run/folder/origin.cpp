#include "run/folder/origin.h"

#include <algorithm>
#include <set>

#include "config/json_text.h"
#include "core/log.h"
#include "core/text.h"
#include "scene/camera.h"

namespace catoptric::run {
namespace {

/// "llvmpipe (LLVM 15.0.6)" of "llvmpipe (LLVM 15.0.6, 256 bits)".
std::string withoutWidth(const std::string& renderer) {
  const std::size_t comma = renderer.rfind(", ");
  if (comma == std::string::npos) return renderer;
  const std::size_t digits = comma + 2;
  const std::size_t end = renderer.find_first_not_of("0123456789", digits);
  return end != std::string::npos && end > digits && renderer.substr(end) == " bits)"
             ? renderer.substr(0, comma) + ")"
             : renderer;
}

}  // namespace

bool sameRenderer(const std::string& a, const std::string& b) {
  return withoutWidth(a) == withoutWidth(b);
}

void Origins::warn(const std::string& run) const {
  std::map<std::string, std::vector<int>> kinds;
  std::set<std::string> lights;
  for (const auto& [origin, frames] : frames_) {
    std::vector<int>& all =
        kinds[joined(std::vector{origin.processor, origin.instructions, origin.renderer}, ", ")];
    all.insert(all.end(), frames.begin(), frames.end());
    lights.insert(origin.light);
  }
  if (kinds.size() > 1) {
    log::warning(
        run + ": its frames were rendered on " + std::to_string(kinds.size()) +
        " kinds of machines. The same frame may differ between two of them by at most 0.05 in "
        "L1_8bit, and in at most 0.5 % of its pixels (docs/running.md). The machines:");
    for (auto& [kind, frames] : kinds) {
      std::sort(frames.begin(), frames.end());
      log::warning("  " + std::to_string(frames.size()) +
                   (frames.size() == 1 ? " frame (" : " frames (") + scene::formatFrames(frames) +
                   ") on " + kind);
    }
  }
  if (lights.size() > 1)
    log::warning(run + ": its frames use " + std::to_string(lights.size()) +
                 " different bakes of the light, so brightness may jump between frames of "
                 "different bakes. Let all machines share one cache (CATOPTRIC_CACHE), and render "
                 "the frames of all but one bake again (docs/cluster.md)");
}

std::string Origins::json() const {
  std::vector<std::string> texts;
  for (const auto& [origin, frames] : frames_)
    texts.push_back(config::JsonText()
                        .add("processor", origin.processor)
                        .add("instructions", origin.instructions)
                        .add("renderer", origin.renderer)
                        .add("light", origin.light)
                        .add("frames", scene::formatFrames(frames))
                        .object());
  return "[" + joined(texts, ",") + "]";
}

}  // namespace catoptric::run
