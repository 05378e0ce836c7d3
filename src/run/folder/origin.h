// By which machine a frame was made, and in which light: what its pixels may depend on a little,
// beside what FrameFingerprints hold.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace catoptric::run {

struct FrameOrigin {
  std::string renderer;      ///< GL_RENDERER, or what else made the pixels
  std::string processor;     ///< its model's name
  std::string instructions;  ///< the instruction sets that Embree and our loops use
  std::string light;         ///< fingerprint of the baked light; empty: none was baked

  auto operator<=>(const FrameOrigin&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Whether two renderers are one program: llvmpipe ends its name by the width of its vectors, which
/// the processor decides.
bool sameRenderer(const std::string& a, const std::string& b);

/// The origins of a run's frames.
class Origins {
 public:
  void add(const FrameOrigin& origin, int frame) { frames_[origin].push_back(frame); }
  /// Warns where several kinds of machines or several bakes have made the frames of `run`, and says
  /// how far these may differ.
  void warn(const std::string& run) const;
  /// An array of {processor, instructions, renderer, light, frames}.
  std::string json() const;

 private:
  std::map<FrameOrigin, std::vector<int>> frames_;
};

}  // namespace catoptric::run
