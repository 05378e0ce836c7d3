// Cameras and camera paths.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/math.h"

namespace catoptric::scene {

struct Scene;

/// A perspective pinhole camera. It looks along its -z axis; +y is up.
struct Camera {
  Mat4 worldFromCamera{1.0f};         ///< a rigid transform
  float verticalFovRad = kPi / 4.0f;  ///< in (0, pi)
  float nearMetres = 0.01f;           ///< positive; there is no far plane

  Vec3 eye() const { return Vec3(worldFromCamera[3]); }
  Vec3 forward() const { return -Vec3(worldFromCamera[2]); }
  bool operator==(const Camera&) const = default;
};

/// Projection with reversed-Z and an infinite far plane, for glClipControl(GL_UPPER_LEFT,
/// GL_ZERO_TO_ONE). Depth is near / distance along -z: 1 at the near plane, 0 at infinity. `aspect`
/// = width / height.
Mat4 clipFromCamera(const Camera& camera, float aspect);
Mat4 cameraFromWorld(const Camera& camera);

/// Direction (unit length, world space) of the ray through image position (x, y), in pixels of a
/// width x height frame. (0, 0) is the upper left corner of the upper left pixel.
Vec3 rayDirection(const Camera& camera, int width, int height, float x, float y);

/// Maps (x, y, 1), with (x, y) as in rayDirection(), to the world-space vector from the eye to the
/// plane 1 metre in front of the camera.
Mat3 rayFromPixel(const Camera& camera, int width, int height);

/// Angle in radians that the height of one pixel subtends at the image centre: the angle of ray
/// cones.
float pixelSpreadRad(const Camera& camera, int height);

/// If a target is nearer to the eye than this (metres), the view direction is undefined. Our
/// choice, far above the distance at which single precision loses the direction.
inline constexpr float kLeastTargetDistance = 1e-9f;
inline bool givesDirection(const Vec3& eye, const Vec3& target) {
  return glm::length(target - eye) >= kLeastTargetDistance;
}

Camera lookAt(const Vec3& eye, const Vec3& target, const Vec3& up, float verticalFovRad);

/// One frame of a path: its number in file names, its camera, and its scene time.
struct PathFrame {
  int number = 1;
  double timeSeconds = 0.0;
  Camera camera;
};

/// A camera path with frames 1..count() at a fixed rate.
class CameraPath {
 public:
  virtual ~CameraPath() = default;
  virtual int count() const = 0;
  virtual PathFrame frame(int number) const = 0;  ///< 1 <= number <= count()
};

/// Loads a path description (JSON, see configs/schema/path.schema.json). `scene` is needed for
/// paths that name a glTF camera. Throws UsageError with the place in the file.
std::unique_ptr<CameraPath> loadPath(const std::filesystem::path& file, const Scene& scene);

/// A path over the scene's animation by a camera that is named: the scene's camera of this name,
/// "front" or "three_quarter" (they show the whole scene), "turntable:N" (N frames around it), or
/// EYE/TARGET[/FOV], such as "2,1,3/0,0.5,0/45" (metres, degrees). Empty: the scene's first camera,
/// otherwise "front". Throws UsageError.
std::unique_ptr<CameraPath> cameraPath(const std::string& text, const Scene& scene);

/// Parses "1-100x2,120": ranges, steps and single frames. The result is ascending and without
/// duplicates. Throws UsageError that shows the place. `count` is the largest allowed number.
std::vector<int> parseFrames(const std::string& text, int count);

/// The inverse of parseFrames(), e.g. "1-9x2,20".
std::string formatFrames(const std::vector<int>& frames);

}  // namespace catoptric::scene
