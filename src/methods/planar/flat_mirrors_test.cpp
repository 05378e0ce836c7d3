#include "methods/planar/flat_mirrors.h"

#include <gtest/gtest.h>

#include "frame/test_scenes.h"
#include "raster/regions/screen.h"

namespace catoptric::methods::planar {
namespace {

View testView() {
  const scene::Camera camera =
      scene::lookAt({0.3f, 1.2f, 4.0f}, {0.1f, 0.2f, 0.0f}, {0.0f, 1.0f, 0.0f}, 0.9f);
  return {
      glm::dmat4(scene::clipFromCamera(camera, 1.5f)) * glm::dmat4(scene::cameraFromWorld(camera)),
      glm::dvec3(camera.eye())};
}

TEST(FlatMirrors, AMirroredViewSeesAPointWhereTheViewSeesItsImage) {
  const View view = testView();
  const Plane plane{glm::normalize(glm::dvec3(0.2, 0.1, 1.0)), -0.4};
  const View other = mirrored(view, plane);
  for (const glm::dvec3& x : {glm::dvec3(0.4, 0.3, 1.0), glm::dvec3(-1.0, 0.7, 2.0)}) {
    const glm::dvec3 image = x - 2.0 * (glm::dot(plane.normal, x) - plane.distance) * plane.normal;
    const glm::dvec4 seen = other.clipFromWorld * glm::dvec4(x, 1.0);
    const glm::dvec4 expected = view.clipFromWorld * glm::dvec4(image, 1.0);
    EXPECT_LT(glm::length(seen - expected), 1e-6 * glm::length(expected));
    EXPECT_GT(glm::dot(other.clip, glm::dvec4(x, 1.0)), 0.0);
    EXPECT_LT(glm::dot(other.clip, glm::dvec4(image, 1.0)), 0.0);
  }
  // Twice mirrored is the view again
  const View again = mirrored(other, plane);
  EXPECT_LT(glm::length(again.eye - view.eye), 1e-9);
  EXPECT_LT(glm::length(again.clip + other.clip), 1e-9);
}

TEST(FlatMirrors, APartOfAFrameShowsWhatTheFrameShowsThere) {
  const View view = testView();
  const raster::Rectangle part{30, 20, 90, 75};
  const glm::dmat4 clip(clipOfPart(view, part, 150, 100));
  const glm::dvec4 x(0.2, 0.5, -0.7, 1.0);
  const glm::dvec4 whole = view.clipFromWorld * x;
  const glm::dvec4 here = clip * x;
  EXPECT_NEAR(part.x0 + 0.5 * part.width() * (1.0 + here.x / here.w),
              75.0 * (1.0 + whole.x / whole.w), 1e-3);
  EXPECT_NEAR(part.y0 + 0.5 * part.height() * (1.0 - here.y / here.w),
              50.0 * (1.0 - whole.y / whole.w), 1e-3);
  EXPECT_NEAR(here.z, whole.z, 1e-6);
  EXPECT_NEAR(here.w, whole.w, 1e-5);
}

TEST(FlatMirrors, ShowsBoxesInTheirRectangleAndAllOfThoseAtTheEye) {
  const View view = testView();
  Box3 box;
  box.extend(Vec3(-0.2f, 0.1f, -0.3f));
  box.extend(Vec3(0.4f, 0.6f, 0.2f));
  const raster::Screen screen(view.clipFromWorld, scene::Camera().nearMetres, 150, 100);
  const raster::Rectangle shown = screen.shows(box);
  EXPECT_LT(shown.width(), 60);
  EXPECT_FALSE(shown.empty());
  const glm::dvec4 corner = view.clipFromWorld * glm::dvec4(0.4, 0.6, 0.2, 1.0);
  const double x = 75.0 * (1.0 + corner.x / corner.w);
  EXPECT_GE(x, shown.x0);
  EXPECT_LE(x, shown.x1);
  box.extend(Vec3(view.eye));
  EXPECT_EQ(screen.shows(box), (raster::Rectangle{0, 0, 150, 100}));
}

TEST(FlatMirrors, MirrorsInOnePlaneShareIt) {
  test::SceneBuilder builder;
  const auto plane = [] { return scene::makePlane({1.0f, 1.0f}, {2, 2}, scene::UvMode::Unit); };
  const int mirror = builder.reflective(1.0f);
  builder.add(plane(), mirror);
  builder.add(plane(), mirror, test::translation({2.0f, 0.0f, 0.0f}));
  builder.add(plane(), mirror, test::translation({0.0f, 0.01f, 3.0f}));
  builder.add(plane(), builder.diffuse(Vec3(0.5f)));
  builder.add(plane(), builder.reflective(0.5f, 0.4f));
  builder.add(scene::makeSphere(0.5f, 16, 8, scene::UvMode::Unit), mirror);
  // From below it is the same plane
  builder.add(plane(), mirror,
              test::translation({-2.0f, 0.0f, 0.0f}) * test::rotation(180.0f, {1.0f, 0.0f, 0.0f}));
  const scene::Scene& scene = builder.scene();
  const frame::Geometry geometry = frame::makeGeometry(scene, scene::poseAt(scene, 0.0));
  const std::vector<FlatMirrors> mirrors = findFlatMirrors(scene, geometry);
  ASSERT_EQ(mirrors.size(), 2u);
  EXPECT_EQ(mirrors[0].ids, (std::vector{1, 2, 7}));
  EXPECT_EQ(mirrors[1].ids, (std::vector{3}));
  EXPECT_NEAR(std::abs(mirrors[1].plane.distance), 0.01, 1e-6);
  EXPECT_NEAR(std::abs(mirrors[0].plane.normal.y), 1.0, 1e-9);
}

}  // namespace
}  // namespace catoptric::methods::planar
