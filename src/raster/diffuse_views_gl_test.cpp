// Many views drawn together show what each shows when it is drawn alone without culled triangles.
#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "raster/test_support.h"

namespace catoptric {
namespace {

using test::SceneBuilder;
using test::translation;
using test::Uploaded;

/// A room, closed surfaces of triangles larger and much smaller than a pixel, and open ones.
scene::Scene room() {
  SceneBuilder builder;
  builder.constantEnvironment(Vec3(0.5f, 0.7f, 1.0f));
  const int wall = builder.diffuse(Vec3(0.7f, 0.68f, 0.6f));
  const int red = builder.diffuse(Vec3(0.8f, 0.2f, 0.1f));
  scene::BoxShape box;
  box.size = Vec3(6.0f, 3.0f, 5.0f);
  box.segments = glm::ivec3(12);
  box.inward = true;
  builder.add(scene::makeBox(box, scene::UvMode::Metres), wall);
  builder.add(scene::makeSphere(0.6f, 96, 64, scene::UvMode::Unit), red, translation({-1, 0, 0}));
  builder.add(scene::makeSphere(0.4f, 8, 6, scene::UvMode::Unit), wall, translation({0, 0.8f, 1}));
  builder.add(scene::makeTorus(0.5f, 0.2f, 80, 60, scene::UvMode::Unit), wall,
              translation({1, -0.5f, -0.5f}));
  builder.add(scene::makePlane({1, 1}, {40, 40}, scene::UvMode::Unit), red,
              translation({1.5f, 0.3f, 1}));
  return builder.scene();
}

TEST(DiffuseViews, CulledTrianglesShowNothing) {
  Uploaded world(room());
  constexpr int kSide = 256;
  const gl::Texture color = gl::Texture::makeArray("colour", GL_RGBA32F, kSide, kSide, 2);
  const gl::Texture depth = gl::Texture::makeArray("depth", GL_DEPTH_COMPONENT32F, kSide, kSide, 2);
  std::vector<gl::Framebuffer> layers;
  for (int layer = 0; layer < 2; ++layer) {
    layers.emplace_back("layer",
                        std::initializer_list<gl::Attachment>{{.texture = color, .layer = layer}},
                        gl::Attachment{.texture = depth, .layer = layer});
  }

  // From within the room and from beside it, with large, small and oblong images
  struct View {
    Vec3 eye, target;
    float angle;
    int x, y, width, height;
  };
  const std::array<View, 6> given = {{{{2.7f, 0.6f, 2.2f}, {-1, 0, 0}, 1.0f, 0, 0, 150, 120},
                                      {{0, 1, 2}, {0, -0.3f, 0}, 1.4f, 150, 0, 16, 16},
                                      {{-2, -1, -2}, {1, 0, 1}, 0.7f, 170, 3, 50, 9},
                                      {{-1, 0, 0.7f}, {-1, 0, 0}, 1.5f, 0, 120, 33, 40},
                                      {{1, -0.5f, -0.5f}, {2, 0, 0}, 2.2f, 60, 130, 90, 70},
                                      {{9, 3, 1}, {0, 0, 0}, 0.5f, 160, 40, 21, 60}}};
  std::vector<raster::DiffuseView> views;
  for (const View& g : given) {
    scene::Camera camera = scene::lookAt(g.eye, g.target, {0, 1, 0}, g.angle);
    raster::DiffuseView view;
    view.clipFromWorld =
        scene::clipFromCamera(camera, static_cast<float>(g.width) / static_cast<float>(g.height)) *
        scene::cameraFromWorld(camera);
    view.eye = g.eye;
    view.x = g.x;
    view.y = g.y;
    view.width = g.width;
    view.height = g.height;
    views.push_back(view);
  }
  layers[0].bind();
  layers[0].clearDepth(0.0f);
  std::vector<std::uint64_t> triangles(views.size());
  world.raster->drawDiffuseViews(views, layers, world.geometry, world.lighting, triangles);
  std::uint64_t alone = 0;
  std::uint64_t together = 0;
  layers[1].bind();
  layers[1].clearDepth(0.0f);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const raster::DiffuseView& view = views[i];
    layers[1].bind();
    glViewport(view.x, view.y, view.width, view.height);
    glScissor(view.x, view.y, view.width, view.height);
    glEnable(GL_SCISSOR_TEST);
    alone +=
        world.raster->drawDiffuse(view.clipFromWorld, view.eye, 0.01f, world.lighting).triangles;
    together += triangles[i];
    EXPECT_GT(triangles[i], 0u) << "view " << i;
  }
  glDisable(GL_SCISSOR_TEST);
  gl::checkErrors("views");
  EXPECT_LT(together, alone / 2);

  const auto colors = color.read<float>(0, GL_RGBA, GL_FLOAT, 4);
  const auto depths = depth.read<float>(0, GL_DEPTH_COMPONENT, GL_FLOAT, 1);
  const std::size_t texels = std::size_t{kSide} * kSide;
  ASSERT_EQ(depths.size(), 2 * texels);
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::size_t covered = 0;
    for (int y = views[i].y; y < views[i].y + views[i].height; ++y) {
      for (int x = views[i].x; x < views[i].x + views[i].width; ++x) {
        const auto at = static_cast<std::size_t>(y * kSide + x);
        ASSERT_EQ(depths[at], depths[texels + at]) << "view " << i << " at " << x << ", " << y;
        if (depths[at] == 0.0f) continue;
        ++covered;
        for (std::size_t c = 0; c < 3; ++c) {
          ASSERT_EQ(colors[4 * at + c], colors[4 * (texels + at) + c])
              << "view " << i << " at " << x << ", " << y;
        }
      }
    }
    EXPECT_GT(covered, 0u) << "view " << i;
  }
}

}  // namespace
}  // namespace catoptric
