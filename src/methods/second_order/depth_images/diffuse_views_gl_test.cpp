// Many views drawn together show what each shows when it is drawn alone without culled triangles.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "gl/draw_state.h"
#include "methods/second_order/depth_images/diffuse_views.h"
#include "raster/test_support.h"

namespace catoptric::methods::second_order {
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

/// Views from within the room and from beside it, with large, small and oblong images.
std::vector<DiffuseView> viewsOfRoom() {
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
  std::vector<DiffuseView> views;
  for (const View& g : given) {
    scene::Camera camera = scene::lookAt(g.eye, g.target, {0, 1, 0}, g.angle);
    DiffuseView view;
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
  return views;
}

/// Two layers with cleared depth.
struct Layers {
  static constexpr int kSide = 256;
  gl::Texture color = gl::Texture::makeArray("colour", GL_RGBA32F, kSide, kSide, 2);
  gl::Texture depth = gl::Texture::makeArray("depth", GL_DEPTH_COMPONENT32F, kSide, kSide, 2);
  std::vector<gl::Framebuffer> targets;

  Layers() {
    for (int layer = 0; layer < 2; ++layer) {
      targets.emplace_back(
          "layer", std::initializer_list<gl::Attachment>{{.texture = color, .layer = layer}},
          gl::Attachment{.texture = depth, .layer = layer});
      targets.back().bind();
      targets.back().clearDepth(0.0f);
    }
  }

  /// Draws each view by itself into layer 1; the triangles drawn.
  std::uint64_t drawAlone(const Uploaded& world, std::span<const DiffuseView> views,
                          int skipObject = 0) {
    std::uint64_t triangles = 0;
    targets[1].bind();
    gl::DrawScope scope{gl::DrawState()};
    const raster::DiffuseDraw what{.objects = raster::ObjectSet::without({skipObject})};
    for (const DiffuseView& view : views) {
      glViewport(view.x, view.y, view.width, view.height);
      scope.change({.scissor = gl::Scissor{view.x, view.y, view.width, view.height}});
      triangles +=
          world.raster->drawDiffuse(view.clipFromWorld, view.eye, 0.01f, world.lighting, what)
              .triangles;
    }
    return triangles;
  }
};

TEST(DiffuseViews, CulledTrianglesShowNothing) {
  Uploaded world(room());
  constexpr int kSide = Layers::kSide;
  Layers images;
  const std::vector<DiffuseView> views = viewsOfRoom();
  std::vector<std::uint64_t> triangles(views.size());
  DiffuseViews().draw(world.raster->scene(), views, {.targets = images.targets}, world.geometry,
                      world.lighting, triangles);
  std::uint64_t together = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    together += triangles[i];
    EXPECT_GT(triangles[i], 0u) << "view " << i;
  }
  EXPECT_LT(together, images.drawAlone(world, views) / 2);
  gl::checkErrors("views");

  const auto colors = images.color.read<float>(0, GL_RGBA, GL_FLOAT, 4);
  const auto depths = images.depth.read<float>(0, GL_DEPTH_COMPONENT, GL_FLOAT, 1);
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

TEST(DiffuseViews, MayEndFarAwayWithoutLosingWhatIsNear) {
  Uploaded world(room());
  constexpr float kUntil = 1.8f;
  Layers whole;
  Layers cut;
  std::vector<DiffuseView> views = viewsOfRoom();
  std::vector<std::uint64_t> all(views.size());
  DiffuseViews().draw(world.raster->scene(), views, {.targets = whole.targets}, world.geometry,
                      world.lighting, all);
  for (DiffuseView& view : views) {
    const Vec4 w = glm::transpose(view.clipFromWorld)[3];  // distance along the axis
    view.farClip = Vec4(0.0f, 0.0f, 0.0f, kUntil) - w;
  }
  std::vector<std::uint64_t> triangles(views.size());
  DiffuseViews().draw(world.raster->scene(), views, {.targets = cut.targets}, world.geometry,
                      world.lighting, triangles);
  gl::checkErrors("views");
  const auto depths = whole.depth.read<float>(0, GL_DEPTH_COMPONENT, GL_FLOAT, 1);
  const auto depthsOfCut = cut.depth.read<float>(0, GL_DEPTH_COMPONENT, GL_FLOAT, 1);
  const auto colors = whole.color.read<float>(0, GL_RGBA, GL_FLOAT, 4);
  const auto colorsOfCut = cut.color.read<float>(0, GL_RGBA, GL_FLOAT, 4);
  const float nearest = scene::Camera().nearMetres;
  std::size_t near = 0;
  std::size_t missing = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    EXPECT_LE(triangles[i], all[i]);
    for (int y = views[i].y; y < views[i].y + views[i].height; ++y) {
      for (int x = views[i].x; x < views[i].x + views[i].width; ++x) {
        const auto at = static_cast<std::size_t>(y * Layers::kSide + x);
        missing += depthsOfCut[at] == 0.0f && depths[at] > 0.0f ? 1 : 0;
        if (depths[at] < 1.001f * nearest / kUntil) continue;
        ++near;
        ASSERT_EQ(depthsOfCut[at], depths[at]) << "view " << i << " at " << x << ", " << y;
        for (std::size_t c = 0; c < 3; ++c) {
          ASSERT_EQ(colorsOfCut[4 * at + c], colors[4 * at + c]);
        }
      }
    }
  }
  EXPECT_GT(near, 1000u);
  EXPECT_GT(missing, 1000u);
  EXPECT_LT(std::accumulate(triangles.begin(), triangles.end(), std::uint64_t{0}),
            std::accumulate(all.begin(), all.end(), std::uint64_t{0}) * 3 / 4);
}

TEST(DiffuseViews, ClipTheirOwnObjectAlone) {
  Uploaded world(room());
  constexpr int kOwn = 2;  // the large sphere
  std::vector<DiffuseView> views = viewsOfRoom();
  for (DiffuseView& view : views) {
    view.ownObject = kOwn;
    view.ownClip = Vec4(0.0f, 0.0f, 0.0f, -1.0f);  // nothing of it is left
  }
  for (const bool compound : {false, true}) {
    Layers images;
    std::vector<std::uint64_t> triangles(views.size());
    DiffuseViews().draw(world.raster->scene(), views,
                        {.targets = images.targets, .compound = compound}, world.geometry,
                        world.lighting, triangles);
    images.drawAlone(world, views, kOwn);
    gl::checkErrors("views");
    const auto depths = images.depth.read<float>(0, GL_DEPTH_COMPONENT, GL_FLOAT, 1);
    constexpr int kSide = Layers::kSide;
    std::size_t texels = 0;
    std::size_t different = 0;
    for (const DiffuseView& view : views) {
      for (int y = view.y; y < view.y + view.height; ++y) {
        for (int x = view.x; x < view.x + view.width; ++x) {
          const auto at = static_cast<std::size_t>(y * kSide + x);
          const float alone = depths[std::size_t{kSide} * kSide + at];
          ++texels;
          different += std::abs(depths[at] - alone) > 1e-3f * alone ? 1 : 0;
        }
      }
    }
    // A compound draw's triangles are cut at borders: edges may fall on the next texel
    EXPECT_LE(different, compound ? texels / 1000 : 0) << "compound " << compound;
  }
}

}  // namespace
}  // namespace catoptric::methods::second_order
