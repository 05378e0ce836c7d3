// The two rooms of [Wang2014], Sec. 4 and Table 1: triangle counts, reflective objects, shares of
// reflective pixels along the paths. Prepares scenes/assets first (a moment once they are there).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "frame/geometry.h"
#include "scene/animate.h"
#include "scene/camera.h"
#include "scene/loader.h"
#include "trace/embree/trace_scene.h"

namespace catoptric {
namespace {

const std::filesystem::path kRoot = CATOPTRIC_SOURCE_DIR;

struct Room {
  const char* name;
  double triangles;
  double diffuseTriangles;
  int reflectors;
  /// Average share of reflective pixels along paths a and b, percent.
  double shareA;
  double shareB;
};

constexpr Room kRooms[] = {{"living_room", 286'000, 156'000, 25, 50.0, 58.0},
                           {"bathroom", 90'000, 44'000, 15, 45.0, 44.0}};

void PrintTo(const Room& room, std::ostream* out) {
  *out << room.name;
}

/// A room with all that its paths are checked with; loaded once for all tests.
struct Loaded {
  scene::Scene scene;
  frame::Geometry geometry;
  std::unique_ptr<trace::TraceScene> tracer;
};

const Loaded& loaded(const Room& room) {
  static std::map<std::string, std::unique_ptr<Loaded>> rooms;
  auto& slot = rooms[room.name];
  if (!slot) {
    slot = std::make_unique<Loaded>();
    slot->scene = scene::loadScene(kRoot / "scenes" / (std::string(room.name) + ".json"));
    slot->geometry = frame::makeGeometry(slot->scene, scene::poseAt(slot->scene, 0.0));
    slot->tracer =
        std::make_unique<trace::TraceScene>(slot->scene, slot->geometry, trace::BvhPolicy::Static);
  }
  return *slot;
}

std::unique_ptr<scene::CameraPath> path(const Room& room, const std::string& suffix) {
  return scene::loadPath(kRoot / "paths" / (std::string(room.name) + "_" + suffix + ".json"),
                         loaded(room).scene);
}

class Rooms : public testing::TestWithParam<Room> {
 protected:
  static void SetUpTestSuite() {
    const std::string command = "'" + (kRoot / "scripts/prepare_assets").string() + "' -q";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
};

TEST_P(Rooms, HasThePapersTrianglesAndReflectors) {
  const Room& room = GetParam();
  const scene::Scene& scene = loaded(room).scene;
  const double total = static_cast<double>(scene.triangleCount());
  const double diffuse = total - static_cast<double>(scene.reflectiveTriangleCount());
  EXPECT_NEAR(total, room.triangles, 0.01 * room.triangles);
  EXPECT_NEAR(diffuse, room.diffuseTriangles, 0.01 * room.diffuseTriangles);
  EXPECT_EQ(scene.reflectorCount(), room.reflectors);
}

TEST_P(Rooms, KeepsEveryTriangleInEmbree) {
  EXPECT_EQ(loaded(GetParam()).tracer->droppedTriangles(), 0u);
}

TEST_P(Rooms, StandsOnItsFloor) {
  const Loaded& room = loaded(GetParam());
  for (std::size_t i = 0; i < room.geometry.objects.size(); ++i) {
    const std::string& name = room.scene.objects[i].name;
    if (name.starts_with("terrace") || name.starts_with("hedge")) continue;  // outside
    EXPECT_GE(room.geometry.objects[i].bounds.min.y, -0.003f) << name;
  }
}

/// Share of reflective pixels and distance to the nearest surface, by rays from one camera.
struct View {
  double reflectiveShare = 0.0;
  float nearestMetres = 0.0f;
};

View look(const Loaded& room, const scene::Camera& camera) {
  constexpr int kSize = 96;
  std::vector<trace::Ray> rays;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      rays.push_back(
          {camera.eye(), scene::rayDirection(camera, kSize, kSize, static_cast<float>(x) + 0.5f,
                                             static_cast<float>(y) + 0.5f)});
    }
  }
  const std::size_t pixels = rays.size();
  // All around the camera: directions on a spiral from pole to pole.
  constexpr int kAround = 256;
  for (int i = 0; i < kAround; ++i) {
    const float z = 1.0f - 2.0f * (static_cast<float>(i) + 0.5f) / kAround;
    const float radius = std::sqrt(1.0f - z * z);
    const float angle = 2.399963f * static_cast<float>(i);
    rays.push_back({camera.eye(), {radius * std::cos(angle), z, radius * std::sin(angle)}});
  }
  std::vector<trace::Hit> hits(rays.size());
  room.tracer->intersect(rays, hits, true);
  View view;
  view.nearestMetres = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].miss()) continue;
    if (i >= pixels) {
      view.nearestMetres = std::min(view.nearestMetres, hits[i].distance);
    } else if (room.scene.objects[hits[i].object].reflector > 0) {
      view.reflectiveShare += 1.0 / static_cast<double>(pixels);
    }
  }
  return view;
}

TEST_P(Rooms, PathsSeeHalfReflectivePixelsAndKeepClear) {
  const Room& room = GetParam();
  for (const auto& [suffix, expected] :
       {std::pair("a", room.shareA), std::pair("b", room.shareB)}) {
    const auto camera = path(room, suffix);
    ASSERT_EQ(camera->count(), 900) << suffix;
    double sum = 0.0;
    constexpr int kFrames = 30;
    for (int i = 0; i < kFrames; ++i) {
      const int number = 1 + i * 31;
      const View view = look(loaded(room), camera->frame(number).camera);
      sum += 100.0 * view.reflectiveShare / kFrames;
      EXPECT_GT(view.nearestMetres, 0.3f) << suffix << " frame " << number;
    }
    EXPECT_NEAR(sum, expected, 3.0) << suffix;
  }
}

TEST_P(Rooms, PathsAreSmoothAndOfTheirLengths) {
  const Room& room = GetParam();
  for (const auto& [suffix, frames] : {std::pair("a", 900), std::pair("b", 900),
                                       std::pair("temporal", 500), std::pair("short", 8)}) {
    const auto camera = path(room, suffix);
    ASSERT_EQ(camera->count(), frames) << suffix;
    if (frames == 8) continue;  // eight views far apart
    for (int number = 2; number <= frames; ++number) {
      const scene::Camera before = camera->frame(number - 1).camera;
      const scene::Camera now = camera->frame(number).camera;
      const float step = glm::length(now.eye() - before.eye());
      const float turn = glm::dot(now.forward(), before.forward());
      ASSERT_LT(step, 0.03f) << suffix << " frame " << number;  // metres
      ASSERT_GT(turn, std::cos(radians(3.0f))) << suffix << " frame " << number;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Wang2014, Rooms, testing::ValuesIn(kRooms),
                         [](const auto& room) { return std::string(room.param.name); });

}  // namespace
}  // namespace catoptric
