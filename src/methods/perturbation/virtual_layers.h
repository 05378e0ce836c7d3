// Draws virtual objects level by level: level n holds what is seen by n reflections. Each has a
// depth buffer of its own; what its objects leave uncovered shows the environment; at last the
// levels are blended, deepest first.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <vector>

#include "gl/objects.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "methods/contract/method.h"
#include "methods/perturbation/path_types.h"

namespace catoptric::methods::perturbation {

class VirtualLayers {
 public:
  /// Keeps a reference to `types`, which draw() asks for the objects of each level.
  explicit VirtualLayers(const PathTypes& types) : types_(types) {}

  void prepare(Services& services, const RunSettings& settings, const std::vector<Kind>& kinds);
  /// Finds the samples that reflectors may cover.
  void findMirrors(const scene::Camera& camera, Services& services, const std::vector<Kind>& kinds);
  const raster::Rectangle& mirrors() const { return mirrors_; }
  /// Of reflectors in reflectors, by number of path type.
  void setTints(std::vector<Vec4> tints);

  /// Draws what the mirrors show, in `part` alone where there is one.
  void draw(const scene::Camera& camera, const std::optional<raster::Region>& part,
            Services& services);
  /// Counts the samples that nothing covers, after draw() with the same part.
  void count(bool inPart, Counters& counters);
  /// Which reflection of each sample nothing covers, counted from 1; 0: none, or a sample that does
  /// not reflect.
  std::vector<std::uint8_t> uncoveredReflections(std::vector<bool> reflects) const;

 private:
  /// Images of what is seen by so many reflections, and what they are drawn into.
  struct Images {
    gl::Texture color;      ///< RGBA32F; empty: the G-buffer's reflection
    gl::Texture direction;  ///< RGBA32F: mirrored at reflectors; likewise for levels that go on
    gl::Texture reflector;  ///< R32UI: numbers of path types
    gl::Texture tint;       ///< RGBA32F: of that reflection; empty where each object has one
    gl::Texture depth;
    gl::Framebuffer last;  ///< colour alone
    gl::Framebuffer goesOn;
  };
  struct Level {
    Images all;
    Images staticPart;  ///< of what stands still, in staticTiles_; uncovered samples have no colour
    gl::Framebuffer uncovered;
    gl::FragmentCounter before;  ///< uncovered samples in what is drawn, before that and after
    gl::FragmentCounter after;
    bool counted = false;  ///< in this frame
  };

  /// Virtual objects by what they are, in the order in which they are drawn.
  enum class Group : std::uint8_t { Static, Reflector, Moving };

  /// In a frame that it shares, masks are clear already.
  bool clearsMasks() const { return settings_.masks && settings_.reflectors.all(); }
  std::size_t levelCount() const { return std::max<std::size_t>(1, types_.deepest()); }
  static const gl::Texture& colorOf(const Images& images, const raster::GBuffer& gbuffer) {
    return images.color.empty() ? gbuffer.reflection : images.color;
  }
  static Images makeImages(const raster::GBuffer& gbuffer, bool inReflection);
  /// ... that a level more follows
  static void goOn(Images& images, const raster::GBuffer& gbuffer);
  /// The images of one level more.
  void addLevel(const raster::GBuffer& gbuffer);
  std::vector<raster::Rectangle> insideMirrors(std::span<const raster::Rectangle> rectangles) const;

  /// Level by level: its virtual objects, then what they leave.
  void drawLevels(const scene::Camera& camera, const std::optional<raster::Region>& part,
                  std::span<const raster::Rectangle> drawn, Services& services);
  /// Joins the levels, deepest first: each is seen through the s of the one before.
  void joinLevels(std::span<const raster::Rectangle> drawn);
  static Group groupOf(const frame::Geometry& geometry, int o, const VirtualObject& object);
  /// A level's samples: their stencil, and no depth.
  void clearLevel(std::size_t number, bool goesOn, Images Level::*images,
                  const raster::GBuffer& gbuffer, std::span<const raster::Rectangle> drawn);
  /// Virtual objects, where the level before shows their reflector. All rectangles at once: changes
  /// of framebuffers are what costs.
  void drawObjects(std::size_t number, bool goesOn, Images Level::*images,
                   const raster::GBuffer& gbuffer, std::initializer_list<Group> groups,
                   std::span<const raster::Rectangle> drawn, const scene::Camera& camera,
                   Services& services);
  /// Draws what stands still where it is needed, the first time with this camera everywhere: many
  /// frames follow where one does, and a frame's first paths cost far more. Returns the G-buffer of
  /// that.
  const raster::GBuffer& drawStatic(const raster::Region& part, std::size_t count,
                                    std::span<const raster::Rectangle> drawn,
                                    const scene::Camera& camera, Services& services);
  /// Puts what stands still into a level's images, but where something that moves hides its
  /// reflector.
  void takeStatic(std::size_t number, bool goesOn, std::span<const raster::Rectangle> drawn,
                  const raster::GBuffer& gbuffer, const raster::GBuffer& staticPart);
  /// Samples of a level without depth: the environment, written where `colors`; counts them.
  void fillUncovered(std::size_t number, std::span<const raster::Rectangle> drawn,
                     const scene::Camera& camera, Services& services,
                     const gl::FragmentCounter& counter, bool colors);

  const PathTypes& types_;
  RunSettings settings_;
  std::vector<Level> levels_;
  bool refracts_ = false;
  gl::Buffer bendBuffer_;
  gl::Texture bends_;  ///< by object id, as uncovered.frag has it; empty: all mirror
  std::uint64_t uncoveredSamples_ = 0;  ///< of the whole frame
  /// What stands still is kept: no reflector moves.
  bool keepsStill_ = true;
  std::optional<raster::Region> staticTiles_;
  raster::Rectangle mirrors_;        ///< samples that reflectors may cover
  std::vector<gl::Define> defines_;  ///< of both
  gl::Program uncovered_;
  gl::Program uncoveredInside_;  ///< on later levels
  gl::Program join_;
  gl::Program hidden_;
  std::vector<Vec4> lastTints_;
  gl::Buffer tintBuffer_;
  gl::Texture tints_;
};

}  // namespace catoptric::methods::perturbation
