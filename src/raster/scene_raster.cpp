#include "raster/scene_raster.h"

#include <algorithm>
#include <utility>

#include "raster/passes/diffuse_pass.h"
#include "raster/passes/gbuffer_pass.h"

namespace catoptric::raster {

struct SceneRaster::State {
  State(const scene::Scene& source, const frame::Geometry& geometry) : scene(source, geometry) {}
  SceneGpu scene;
  GBufferPass gbuffer{scene};
  DiffusePass diffuse{scene};
  CompositePass composite;
  std::filesystem::path levelCache;
};

SceneRaster::SceneRaster(const scene::Scene& scene, const frame::Geometry& geometry)
    : state_(std::make_unique<State>(scene, geometry)) {}

SceneRaster::~SceneRaster() = default;

SceneGpu& SceneRaster::scene() {
  return state_->scene;
}

const FrameView& SceneRaster::gbufferView() const {
  return state_->gbuffer.view();
}

void SceneRaster::update(const frame::Geometry& geometry, std::span<const int> changedObjects) {
  state_->scene.update(geometry, changedObjects);
  state_->gbuffer.forget(changedObjects);
}

void SceneRaster::cacheLevelsIn(std::filesystem::path folder) {
  state_->levelCache = std::move(folder);
}

void SceneRaster::buildDetailLevels(const scene::Scene& scene, const frame::Geometry& geometry,
                                    const frame::Lighting& lighting) {
  state_->scene.buildDetailLevels(scene, geometry, lighting, state_->levelCache);
}

GBuffer SceneRaster::makeGBuffer(const GBufferSize& size) const {
  GBufferSize needed = size;
  needed.tints = state_->scene.materials().tintVaries();
  needed.highlights = state_->scene.materials().highlights();
  needed.lobeHorizons = state_->scene.materials().lobeHorizons();
  return raster::makeGBuffer(needed);
}

DrawStatistics SceneRaster::drawGBuffer(GBuffer& target, const scene::Camera& camera,
                                        const frame::Lighting& lighting,
                                        const std::optional<Region>& part,
                                        const frame::Geometry* geometry) {
  return state_->gbuffer.draw(target, camera, lighting, part, geometry);
}

const GBuffer& SceneRaster::drawStill(const GBuffer& like, const scene::Camera& camera,
                                      const frame::Lighting& lighting, const Region& part,
                                      const frame::Geometry& geometry, DrawStatistics* statistics) {
  return state_->gbuffer.drawStill(like, camera, lighting, part, geometry, statistics);
}

DrawStatistics SceneRaster::drawDiffuse(const Mat4& clipFromWorld, const Vec3& eye,
                                        float pixelSpreadRad, const frame::Lighting& lighting,
                                        const DiffuseDraw& what) {
  return state_->diffuse.draw(clipFromWorld, eye, pixelSpreadRad, lighting, what);
}

gl::Texture SceneRaster::drawCubeMap(const Vec3& centre, int faceSize,
                                     const frame::Lighting& lighting, const ObjectSet& objects,
                                     gl::Texture earlier) {
  return state_->diffuse.drawCubeMap(centre, faceSize, lighting, objects, std::move(earlier));
}

void SceneRaster::composite(const GBuffer& source, const scene::Camera& camera,
                            const CompositeOptions& options, gl::Texture& frame,
                            const std::optional<Region>& part) {
  state_->composite.draw(source, state_->scene.materials(), camera, options, frame, part);
}

void SceneRaster::bindShadingResources(std::uint32_t program,
                                       const frame::Lighting& lighting) const {
  glUseProgram(program);
  state_->scene.frame().bind(gbufferView(), lighting);
  state_->scene.frame().bindEnvironment(lighting);
}

std::vector<gl::Define> SceneRaster::shadingDefines(const frame::Lighting& lighting) {
  std::vector<gl::Define> defines = lightDefines(lighting);
  defines.push_back({"ENVIRONMENT", environmentType(lighting)});
  defines.push_back({"SKY", hasSky(lighting) ? "1" : "0"});
  return defines;
}

std::size_t SceneRaster::memoryBytes() const {
  return state_->scene.bytes();
}

std::uint64_t clampedTexels(std::span<const std::uint16_t> texels) {
  constexpr int kLargestHalf = 0x7BFF;
  constexpr int kSize = 0x7FFF;  // all but the sign
  std::uint64_t count = 0;
  for (std::size_t i = 0; i + 3 < texels.size(); i += 4) {
    const int most = std::max({texels[i] & kSize, texels[i + 1] & kSize, texels[i + 2] & kSize});
    count += most >= kLargestHalf ? 1 : 0;
  }
  return count;
}

std::uint64_t clampedTexels(const gl::Texture& texture) {
  return clampedTexels(texture.read<std::uint16_t>(0, GL_RGBA, GL_HALF_FLOAT, 4));
}

}  // namespace catoptric::raster
