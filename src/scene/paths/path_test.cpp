// Cameras, curves, paths and the frame syntax.
#include "scene/paths/path.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "scene/camera.h"
#include "scene/paths/curve.h"
#include "scene/scene.h"

namespace catoptric::scene {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<CameraPath> pathOf(const std::string& text, const Scene& scene = {}) {
  return makePath(config::parseText(text, "path.json"), scene);
}

std::string pathError(const std::string& text) {
  try {
    pathOf(text);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Camera, ClipMatrixIsReversedAndInfinite) {
  Camera camera;
  camera.verticalFovRad = kPi / 2.0f;
  camera.nearMetres = 0.5f;
  const Mat4 clip = clipFromCamera(camera, 2.0f);
  // By hand: x/2, y, near, -z.
  const Vec4 p = clip * Vec4(3.0f, 1.0f, -4.0f, 1.0f);
  EXPECT_FLOAT_EQ(p.x, 1.5f);
  EXPECT_FLOAT_EQ(p.y, 1.0f);
  EXPECT_FLOAT_EQ(p.z, 0.5f);
  EXPECT_FLOAT_EQ(p.w, 4.0f);
  const Vec4 atNear = clip * Vec4(0.0f, 0.0f, -0.5f, 1.0f);
  EXPECT_FLOAT_EQ(atNear.z / atNear.w, 1.0f);
}

TEST(Camera, RaysAgreeWithTheProjection) {
  const Camera camera = lookAt({1, 2, 3}, {-2, 0.5f, -1}, {0, 1, 0}, radians(50.0f));
  const int width = 640;
  const int height = 360;
  const Mat4 clip = clipFromCamera(camera, 640.0f / 360.0f) * cameraFromWorld(camera);
  for (const Vec2 pixel : {Vec2(0, 0), Vec2(640, 360), Vec2(320, 180), Vec2(12.5f, 300.25f)}) {
    const Vec3 direction = rayDirection(camera, width, height, pixel.x, pixel.y);
    EXPECT_NEAR(glm::length(direction), 1.0f, 1e-6f);
    const Vec4 p = clip * Vec4(camera.eye() + 2.0f * direction, 1.0f);
    EXPECT_NEAR(p.x / p.w, 2.0f * pixel.x / 640.0f - 1.0f, 2e-6f);
    EXPECT_NEAR(p.y / p.w, 1.0f - 2.0f * pixel.y / 360.0f, 2e-6f);
  }
  EXPECT_NEAR(glm::dot(camera.forward(), glm::normalize(Vec3(-3, -1.5f, -4))), 1.0f, 1e-6f);
  EXPECT_GT(camera.worldFromCamera[1].y, 0.0f);
  // Straight down has a frame too.
  EXPECT_TRUE(isFinite(Vec3(lookAt({0, 1, 0}, {0, 0, 0}, {0, 1, 0}, 1.0f).worldFromCamera[0])));
  EXPECT_NEAR(pixelSpreadRad(camera, height),
              std::acos(glm::dot(rayDirection(camera, width, height, 320, 179.5f),
                                 rayDirection(camera, width, height, 320, 180.5f))),
              2e-4f);
}

TEST(Curves, HitTheirKeysAndAreContinuous) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {1.2f, 1, 0}, {4, 1, 2}, {4, 1, 2.5f}};
  const std::vector<double> times{0.0, 1.0, 1.5, 4.0, 5.0};
  const TimedCurve curve(points, times, false);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT(glm::length(curve.at(times[i]) - points[i]), 1e-5f);
  }
  // Velocity is continuous: its jump over a key goes to nothing.
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const double h = 0.01;
    const Vec3 before = (curve.at(times[i]) - curve.at(times[i] - h)) / static_cast<float>(h);
    const Vec3 after = (curve.at(times[i] + h) - curve.at(times[i])) / static_cast<float>(h);
    EXPECT_LT(glm::length(after - before), 0.12f * std::max(glm::length(before), 0.5f)) << i;
  }
  const MonotoneCubic monotone({0, 1, 2, 3}, {0, 1, 1, 5});
  EXPECT_DOUBLE_EQ(monotone.at(1.5), 1.0);
  double last = -1.0;
  for (double x = 0.0; x <= 3.0; x += 0.01) {
    EXPECT_GE(monotone.at(x), last);
    last = monotone.at(x);
  }
}

TEST(Curves, RotationsTakeTheShorterArc) {
  const Quat a = glm::angleAxis(radians(10.0f), Vec3(0, 1, 0));
  const Quat b = -glm::angleAxis(radians(50.0f), Vec3(0, 1, 0));
  const Quat middle = slerpShortest(a, b, 0.5);
  EXPECT_NEAR(std::abs(glm::dot(middle, glm::angleAxis(radians(30.0f), Vec3(0, 1, 0)))), 1.0f,
              1e-6f);
  // Constant angular velocity through keys stays so, whatever the signs.
  const TimedRotation rotation({a, b, glm::angleAxis(radians(90.0f), Vec3(0, 1, 0))},
                               {0.0, 1.0, 2.0});
  for (const double t : {0.0, 0.25, 1.0, 1.7, 2.0}) {
    const Quat expected =
        glm::angleAxis(radians(10.0f + 40.0f * static_cast<float>(t)), Vec3(0, 1, 0));
    EXPECT_NEAR(std::abs(glm::dot(rotation.at(t), expected)), 1.0f, 1e-6f) << t;
  }
}

TEST(Curves, RotationsAccelerateEvenlyOverUnevenSpans) {
  // A turn by 0.1 t^2: at inner keys the rate of the parabola, at the ends that of their spans.
  const std::vector<double> times{0.0, 1.0, 3.0, 3.5, 5.0};
  std::vector<Quat> keys;
  for (const double t : times)
    keys.push_back(glm::angleAxis(0.1f * static_cast<float>(t * t), Vec3(0, 1, 0)));
  const TimedRotation rotation(keys, times);
  const auto turnTo = [&](double t) { return glm::angle(rotation.at(t)); };
  for (const double t : {1.01, 2.0, 2.99, 3.01, 3.4})
    EXPECT_NEAR(turnTo(t), 0.1 * t * t, 1e-5) << t;
  EXPECT_NEAR(turnTo(0.01) / 0.01, 0.1, 0.01);
  EXPECT_NEAR((turnTo(5.0) - turnTo(4.99)) / 0.01, 0.1 * (25.0 - 12.25) / 1.5, 0.01);
}

TEST(Paths, KeyframesOrbitWalk) {
  const auto keys = pathOf(
      R"({"frames": 5, "keyframes": [{"position": [0,1,4], "target": [0,0,0]},
         {"position": [4,1,0], "target": [0,0,0], "fov": 30}]})");
  EXPECT_EQ(keys->count(), 5);
  EXPECT_LT(glm::length(keys->frame(1).camera.eye() - Vec3(0, 1, 4)), 1e-5f);
  EXPECT_LT(glm::length(keys->frame(5).camera.eye() - Vec3(4, 1, 0)), 1e-5f);
  EXPECT_NEAR(keys->frame(5).camera.verticalFovRad, radians(30.0f), 1e-6f);
  EXPECT_NEAR(keys->frame(4).timeSeconds, 0.1, 1e-9);

  const auto timed = pathOf(
      R"({"fps": 10, "keyframes": [{"time": 0, "position": [0,1,4], "orientation": [0,0,0,1]},
         {"time": 2, "position": [0,1,0], "orientation": [0,0.7071068,0,0.7071068]}]})");
  EXPECT_EQ(timed->count(), 21);
  EXPECT_LT(glm::length(timed->frame(21).camera.forward() - Vec3(-1, 0, 0)), 1e-5f);

  const auto orbit = pathOf(
      R"({"frames": 8, "orbit": {"center": [1,0,0], "radius": 2, "height": 1, "start": 90}})");
  EXPECT_LT(glm::length(orbit->frame(1).camera.eye() - Vec3(3, 1, 0)), 1e-5f);
  EXPECT_LT(glm::length(orbit->frame(5).camera.eye() - Vec3(-1, 1, 0)), 1e-5f);
  EXPECT_NEAR(glm::dot(orbit->frame(3).camera.forward(),
                       glm::normalize(Vec3(1, 0, 0) - orbit->frame(3).camera.eye())),
              1.0f, 1e-6f);

  const auto walk = pathOf(
      R"({"frames": 101, "walk": {"points": [[0,0],[0,-2],[3,-4],[6,-4]], "eye_height": 1.5}})");
  const float step = glm::length(walk->frame(2).camera.eye() - walk->frame(1).camera.eye());
  for (int f = 2; f <= 101; ++f) {
    EXPECT_NEAR(glm::length(walk->frame(f).camera.eye() - walk->frame(f - 1).camera.eye()), step,
                0.03f * step);
    EXPECT_NEAR(walk->frame(f).camera.eye().y, 1.5f, 1e-5f);
  }
  EXPECT_GT(walk->frame(101).camera.forward().x, 0.9f);

  const auto both = pathOf(
      R"({"segments": [{"frames": 3, "orbit": {"center": [0,0,0], "radius": 1}},
                       {"frames": 2, "walk": {"points": [[0,0],[1,0]]}}]})");
  EXPECT_EQ(both->count(), 5);
  EXPECT_EQ(both->frame(4).number, 4);
  EXPECT_LT(glm::length(both->frame(4).camera.eye() - Vec3(0, 1.6f, 0)), 1e-5f);
}

TEST(Paths, ErrorsNameThePlace) {
  EXPECT_THAT(pathError(R"({"frames": 2})"), HasSubstr("needs one of keyframes"));
  EXPECT_THAT(pathError(R"({"keyframe": []})"), HasSubstr("did you mean \"keyframes\""));
  EXPECT_THAT(pathError(R"({"keyframes": [{"position": [0,0,0]}]})"), HasSubstr("/keyframes/0"));
  EXPECT_THAT(pathError(R"({"keyframes": [{"time": 1, "position": [0,0,1], "target": [0,0,0]},
                          {"time": 1, "position": [0,0,2], "target": [0,0,0]}]})"),
              HasSubstr("times must increase"));
  EXPECT_THAT(pathError(R"({"gltf_camera": "front"})"), HasSubstr("has no cameras"));
}

TEST(Frames, ParseAndFormat) {
  EXPECT_EQ(parseFrames("1-9x2,20", 30), (std::vector<int>{1, 3, 5, 7, 9, 20}));
  EXPECT_EQ(parseFrames(" 5, 3 - 4 ,4", 30), (std::vector<int>{3, 4, 5}));
  EXPECT_EQ(formatFrames({1, 3, 5, 7, 9, 20}), "1-9x2,20");
  EXPECT_EQ(formatFrames({20, 1, 2, 2}), "1-2,20");
  EXPECT_EQ(formatFrames({}), "");
  for (const char* text : {"1-99x2,120", "7", "1-3,9-30x7", "2,4"}) {
    EXPECT_EQ(formatFrames(parseFrames(text, 200)), text);
  }
  const auto error = [](const std::string& text) {
    try {
      parseFrames(text, 100);
    } catch (const UsageError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error("1-10y2"), HasSubstr("character 5: unexpected 'y'"));
  EXPECT_THAT(error("1,,2"), HasSubstr("character 3"));
  EXPECT_THAT(error(""), HasSubstr("the text ends"));
  EXPECT_THAT(error("0-4"), HasSubstr("numbered from 1"));
  EXPECT_THAT(error("9-4"), HasSubstr("runs backwards"));
  EXPECT_THAT(error("1-101"), HasSubstr("beyond the path's 100 frames"));
  EXPECT_THAT(error("1-5x0"), HasSubstr("the step is 0"));
  EXPECT_THAT(error("99999999999999"), HasSubstr("too large"));
}

TEST(Path, SceneCamerasHaveTheirNearPlaneUnlessThePathSaysOne) {
  Scene scene;
  scene.cameras.resize(2);
  scene.cameras[0].nearMetres = 1e-5f;
  const auto nearOf = [&](const std::string& path) {
    return makePath(config::parseText(path, "path.json"), scene)->frame(1).camera.nearMetres;
  };
  EXPECT_FLOAT_EQ(nearOf(R"({"gltf_camera": ""})"), 1e-5f);
  EXPECT_FLOAT_EQ(nearOf(R"({"gltf_camera": "", "near": 0.5})"), 0.5f);
  EXPECT_FLOAT_EQ(cameraPath("", scene)->frame(1).camera.nearMetres, 1e-5f);
  scene.cameras[0].nearMetres = 0.0f;  // not said
  EXPECT_FLOAT_EQ(nearOf(R"({"gltf_camera": ""})"), 0.01f);
}

TEST(Path, CamerasAreNamedOrGivenByNumbers) {
  // A box of 2 x 4 x 6 m, about (5, 0, 0), and a bar along x, in a scene far away
  Scene scene;
  scene.origin = {1e6, 0, 0};
  scene.meshes.resize(1);
  scene.objects.push_back({.name = "box", .mesh = 0});
  for (const float x : {4.0f, 6.0f})
    for (const float y : {-2.0f, 2.0f})
      for (const float z : {-3.0f, 3.0f}) scene.meshes[0].positions.emplace_back(x + 1e6f, y, z);
  for (const float x : {0.0f, 10.0f}) scene.meshes[0].positions.emplace_back(x + 1e6f, 0, 0);
  scene.meshes[0].normals.assign(10, Vec3(0, 1, 0));
  scene.cameras.resize(1);
  scene.cameras[0].name = "hall";
  scene.cameras[0].verticalFovRad = 0.5f;
  const auto cameraOf = [&](const std::string& text) {
    return cameraPath(text, scene)->frame(1).camera;
  };
  EXPECT_FLOAT_EQ(cameraOf("").verticalFovRad, 0.5f);
  EXPECT_FLOAT_EQ(cameraOf("hall").verticalFovRad, 0.5f);
  const Camera given = cameraOf("1000005,1,3/1000005,1,0/30");
  EXPECT_EQ(given.eye(), Vec3(5, 1, 3));
  EXPECT_NEAR(given.forward().z, -1.0f, 1e-6f);
  EXPECT_FLOAT_EQ(given.verticalFovRad, radians(30.0f));
  EXPECT_FLOAT_EQ(cameraOf("1000005,1,3/1000005,1,0").verticalFovRad, radians(45.0f));
  // All corners are in the image, the outermost at 5 % from its edge at most
  const auto showsTheBox = [&](const Camera& camera) {
    const Mat4 clip = clipFromCamera(camera, 1.0f) * cameraFromWorld(camera);
    float most = 0.0f;
    for (const Vec3& p : scene.meshes[0].positions) {
      const Vec4 at = clip * Vec4(p - Vec3(1e6f, 0, 0), 1.0f);
      most = std::max({most, std::abs(at.x / at.w), std::abs(at.y / at.w)});
    }
    EXPECT_LT(most, 1.0f);
    return most;
  };
  for (const char* name : {"front", "three_quarter"}) EXPECT_GT(showsTheBox(cameraOf(name)), 0.9f);
  const auto around = cameraPath("turntable:48", scene);
  ASSERT_EQ(around->count(), 48);
  for (int i = 1; i <= 48; ++i) showsTheBox(around->frame(i).camera);
  EXPECT_NEAR(around->frame(1).camera.forward().z, -around->frame(25).camera.forward().z, 1e-4f);
  const auto error = [&](const std::string& text) -> std::string {
    try {
      cameraOf(text);
    } catch (const UsageError& refused) {
      return refused.what();
    }
    return "no error";
  };
  EXPECT_THAT(error("hal"), HasSubstr("did you mean \"hall\""));
  EXPECT_THAT(error("turntable:0"), HasSubstr("from 1 to"));
  EXPECT_THAT(error("1,2/3"), HasSubstr("is not EYE/TARGET/FOV"));
  EXPECT_THAT(error("1,2,3/1,2,3"), HasSubstr("same point"));
  for (const char* text : {"1,2,3/0,0,0/180", "1,2,3/0,0,0/", "1,2,3/0,0,0/4,5"})
    EXPECT_THAT(error(text), HasSubstr("from 0.001 to 179.9")) << text;
}

TEST(Path, ATargetAtTheCameraIsRefused) {
  EXPECT_THAT(pathError(R"({"keyframes": [{"position": [0,0,1], "target": [1e-30,0,1]}]})"),
              HasSubstr("position and target are the same point"));
  EXPECT_THAT(pathError(R"({"keyframes": [{"position": [0,0,0], "target": [1e-30,0,0]}]})"),
              HasSubstr("position and target are the same point"));
  // On the way only: frame 2 of 3 is at the target
  const Scene scene;
  const auto path = makePath(
      config::parseText(R"({"frames": 3, "keyframes": [{"position": [0,0,1], "target": [0,0,0]},
                            {"position": [0,0,-1], "target": [0,0,0]}]})",
                        "path"),
      scene);
  EXPECT_NO_THROW(path->frame(1));
  EXPECT_THROW(path->frame(2), UsageError);
}

}  // namespace
}  // namespace catoptric::scene
