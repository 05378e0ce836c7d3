// The kinds of camera paths and the settings they share; private to this folder.
#pragma once

#include <memory>

#include "config/json.h"
#include "scene/camera.h"
#include "scene/scene.h"

namespace catoptric::scene {

inline constexpr int kMaxPathFrames = 1'000'000;

/// Reads a coordinate or length. Throws UsageError beyond kMaxCoordinate.
double metresOf(const config::Value& value);

/// Settings that all kinds of paths share.
struct PathSettings {
  int frames = 1;
  double fps = 30.0;
  double startTime = 0.0;
  bool sceneTime = true;
  bool ease = false;
  float fovRad = radians(60.0f);
  float nearMetres = 0.01f;
  Vec3 up{0.0f, 1.0f, 0.0f};
  glm::dvec3 origin{0.0};  ///< origin of the scene's world space

  /// A position from the file, in world space.
  Vec3 position(const config::Value& value) const;

  /// The fraction of the path at frame `number`: 0 at the first frame, 1 at the last. The last
  /// frame of a loop stops one step before its first frame.
  double share(int number, bool loop) const {
    const int steps = loop ? frames : frames - 1;
    const double u = steps > 0 ? static_cast<double>(number - 1) / steps : 0.0;
    return ease ? u * u * u * (u * (6.0 * u - 15.0) + 10.0) : u;
  }
  double timeOf(int number) const {
    return sceneTime ? startTime + static_cast<double>(number - 1) / fps : startTime;
  }
  PathFrame frame(int number, Camera camera) const {
    camera.nearMetres = nearMetres;
    return {number, timeOf(number), camera};
  }
  /// Throws UsageError if the eye coincides with the target.
  PathFrame lookingAt(int number, const Vec3& eye, const Vec3& target, float fovOfFrame) const;
};

class CommonPath : public CameraPath {
 public:
  explicit CommonPath(const PathSettings& common) : common_(common) {}
  int count() const override { return common_.frames; }

 protected:
  PathSettings common_;
};

const config::Schema& keyframeSchema();
const config::Schema& orbitSchema();
const config::Schema& walkSchema();

/// Makes a path from "keyframes". The times of the keys determine the number of frames, unless
/// `framesGiven`.
std::unique_ptr<CameraPath> makeKeyframes(const config::Value& path, PathSettings common,
                                          bool framesGiven);
std::unique_ptr<CameraPath> makeOrbit(const config::Value& orbit, const PathSettings& common);
std::unique_ptr<CameraPath> makeWalk(const config::Value& walk, const PathSettings& common);

}  // namespace catoptric::scene
