// The machine and the baked light with which a frame was made. Its pixels may depend slightly on
// them, in addition to what FrameFingerprints records.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace catoptric::run {

struct FrameOrigin {
  std::string renderer;      ///< GL_RENDERER, or another name of what made the pixels
  std::string processor;     ///< model name of the processor
  std::string instructions;  ///< the instruction sets that Embree and the program's own loops use
  std::string light;         ///< fingerprint of the baked light; empty: no light was baked

  auto operator<=>(const FrameOrigin&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Whether two renderers are the same program. llvmpipe's name ends with its vector width, which
/// depends on the processor; that part is ignored.
bool sameRenderer(const std::string& a, const std::string& b);

/// The origins of a run's frames.
class Origins {
 public:
  void add(const FrameOrigin& origin, int frame) { frames_[origin].push_back(frame); }
  /// Warns if several kinds of machines, or several bakes, have made the frames of `run`, and says
  /// how much their pixels may differ.
  void warn(const std::string& run) const;
  /// A JSON array of {processor, instructions, renderer, light, frames}.
  std::string json() const;

 private:
  std::map<FrameOrigin, std::vector<int>> frames_;
};

}  // namespace catoptric::run
