// Cameras and camera paths: what one frame is seen with.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/math.h"

namespace catoptric::scene {

struct Scene;

/// A perspective pinhole camera. It looks along its -z, +y is up.
struct Camera {
  Mat4 worldFromCamera{1.0f};         ///< rigid
  float verticalFovRad = kPi / 4.0f;  ///< in (0, pi)
  float nearMetres = 0.01f;           ///< positive; there is no far plane

  Vec3 eye() const { return Vec3(worldFromCamera[3]); }
  Vec3 forward() const { return -Vec3(worldFromCamera[2]); }
  bool operator==(const Camera&) const = default;
};

/// Reversed-Z, infinite far plane, for glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE): depth is
/// near / distance along -z, 1 at the near plane, 0 at infinity. `aspect` = width / height.
Mat4 clipFromCamera(const Camera& camera, float aspect);
Mat4 cameraFromWorld(const Camera& camera);

/// Direction (unit length, world space) through image position (x, y) in pixels of a width x height
/// frame; (0, 0) is the upper left corner of the upper left pixel.
Vec3 rayDirection(const Camera& camera, int width, int height, float x, float y);

/// Maps (x, y, 1) of an image position as above to the ray through it: world space, 1 metre along
/// the camera's axis.
Mat3 rayFromPixel(const Camera& camera, int width, int height);

/// Angle that one pixel's height subtends at the image centre, radians: the spread of ray cones.
float pixelSpreadRad(const Camera& camera, int height);

/// Nearer targets give no direction. Metres; ours, far above where single precision loses it.
inline constexpr float kLeastTargetDistance = 1e-9f;
inline bool givesDirection(const Vec3& eye, const Vec3& target) {
  return glm::length(target - eye) >= kLeastTargetDistance;
}

Camera lookAt(const Vec3& eye, const Vec3& target, const Vec3& up, float verticalFovRad);

/// One frame of a path: the number under which it is stored, its camera, its scene time.
struct PathFrame {
  int number = 1;
  double timeSeconds = 0.0;
  Camera camera;
};

/// A camera path: frames 1..count() at a fixed rate.
class CameraPath {
 public:
  virtual ~CameraPath() = default;
  virtual int count() const = 0;
  virtual PathFrame frame(int number) const = 0;  ///< 1 <= number <= count()
};

/// Loads a path description (JSON, see configs/schema/path.schema.json). `scene` serves paths
/// that name a glTF camera. Throws UsageError with the place in the file.
std::unique_ptr<CameraPath> loadPath(const std::filesystem::path& file, const Scene& scene);

/// The scene's first camera as a path of `frames` frames over its animation; a camera that sees
/// the whole scene from the front when the scene has none.
std::unique_ptr<CameraPath> defaultPath(const Scene& scene);

/// Parses "1-100x2,120": ranges, steps, single frames; ascending and without repeats in the
/// result. Throws UsageError that shows the place. `count` bounds the numbers.
std::vector<int> parseFrames(const std::string& text, int count);

/// The inverse: "1-9x2,20".
std::string formatFrames(const std::vector<int>& frames);

}  // namespace catoptric::scene
