// Draws virtual objects level by level: level n contains what is visible after n reflections. Each
// level has its own depth buffer, and its uncovered samples show the environment. Finally the
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
  /// Keeps a reference to `types`, from which draw() takes the objects of each level.
  explicit VirtualLayers(const PathTypes& types) : types_(types) {}

  void prepare(Services& services, const RunSettings& settings, const std::vector<Kind>& kinds);
  /// Finds the samples that reflectors may cover.
  void findMirrors(const scene::Camera& camera, Services& services, const std::vector<Kind>& kinds);
  const raster::Rectangle& mirrors() const { return mirrors_; }
  /// Sets the tints of reflectors that are seen in other reflectors, by number of the path type.
  void setTints(std::vector<Vec4> tints);

  /// Draws the reflections of all mirrors, only within `part` if it is given.
  void draw(const scene::Camera& camera, const std::optional<raster::Region>& part,
            Services& services);
  /// Counts the uncovered samples, after draw() with the same part.
  void count(bool inPart, Counters& counters);
  /// For each sample, which of its reflections (from 1) no virtual object covers; 0: none, or the
  /// sample is not reflective.
  std::vector<std::uint8_t> uncoveredReflections(std::vector<bool> reflects) const;

 private:
  /// The images of one level and their framebuffers.
  struct Images {
    gl::Texture color;      ///< RGBA32F; empty: the G-buffer's reflection
    gl::Texture direction;  ///< RGBA32F: outgoing direction; goOn() makes this and the next two
    gl::Texture reflector;  ///< R32UI: numbers of path types
    gl::Texture tint;  ///< RGBA32F: tint of that reflection; empty if each object has a single tint
    gl::Texture depth;
    gl::Framebuffer last;  ///< colour only
    gl::Framebuffer goesOn;
  };
  struct Level {
    Images all;
    Images staticPart;  ///< the static objects, in staticTiles_; elsewhere no colour
    gl::Framebuffer uncovered;
    gl::FragmentCounter before;  ///< uncovered samples before drawing; `after`: afterwards
    gl::FragmentCounter after;
    bool counted = false;  ///< counted in this frame
  };

  /// Kinds of virtual objects, in the order in which they are drawn.
  enum class Group : std::uint8_t { Static, Reflector, Moving };

  /// If methods share the frame, the masks are already cleared.
  bool clearsMasks() const { return settings_.masks && settings_.reflectors.all(); }
  std::size_t levelCount() const { return std::max<std::size_t>(1, types_.deepest()); }
  static const gl::Texture& colorOf(const Images& images, const raster::GBuffer& gbuffer) {
    return images.color.empty() ? gbuffer.reflection : images.color;
  }
  static Images makeImages(const raster::GBuffer& gbuffer, bool inReflection);
  /// Extends the images for a further level.
  static void goOn(Images& images, const raster::GBuffer& gbuffer);
  /// The images of a further level.
  void addLevel(const raster::GBuffer& gbuffer);
  std::vector<raster::Rectangle> insideMirrors(std::span<const raster::Rectangle> rectangles) const;

  /// Draws each level: its virtual objects, then the uncovered samples.
  void drawLevels(const scene::Camera& camera, const std::optional<raster::Region>& part,
                  std::span<const raster::Rectangle> drawn, Services& services);
  /// Blends the levels, deepest first, each with the s of the level before.
  void joinLevels(std::span<const raster::Rectangle> drawn);
  static Group groupOf(const frame::Geometry& geometry, int o, const VirtualObject& object);
  /// Prepares a level's samples: sets their stencil and clears their depth.
  void clearLevel(std::size_t number, bool goesOn, Images Level::*images,
                  const raster::GBuffer& gbuffer, std::span<const raster::Rectangle> drawn);
  /// Draws virtual objects where the preceding level shows their reflector. All rectangles are
  /// drawn at once, because changes of framebuffers are expensive.
  void drawObjects(std::size_t number, bool goesOn, Images Level::*images,
                   const raster::GBuffer& gbuffer, std::initializer_list<Group> groups,
                   std::span<const raster::Rectangle> drawn, const scene::Camera& camera,
                   Services& services);
  /// Draws the static objects where they are needed. If the camera is new, draws them everywhere,
  /// because frames with the same camera usually follow, and finding a frame's first paths costs
  /// far more than finding further ones. Returns the G-buffer of the static part.
  const raster::GBuffer& drawStatic(const raster::Region& part, std::size_t count,
                                    std::span<const raster::Rectangle> drawn,
                                    const scene::Camera& camera, Services& services);
  /// Copies the static part into a level's images, except behind moving objects.
  void takeStatic(std::size_t number, bool goesOn, std::span<const raster::Rectangle> drawn,
                  const raster::GBuffer& gbuffer, const raster::GBuffer& staticPart);
  /// Counts a level's samples without depth and, if `colors`, shades them with the environment.
  void fillUncovered(std::size_t number, std::span<const raster::Rectangle> drawn,
                     const scene::Camera& camera, Services& services,
                     const gl::FragmentCounter& counter, bool colors);

  const PathTypes& types_;
  RunSettings settings_;
  std::vector<Level> levels_;
  bool refracts_ = false;
  gl::Buffer bendBuffer_;
  gl::Texture bends_;  ///< by object id, as in uncovered.frag; empty: all objects are mirrors
  std::uint64_t uncoveredSamples_ = 0;  ///< in the whole frame
  /// Whether the static part is kept: no reflector moves.
  bool keepsStill_ = true;
  std::optional<raster::Region> staticTiles_;
  raster::Rectangle mirrors_;  ///< bounding rectangle of the samples that reflectors may cover
  std::vector<gl::Define> defines_;  ///< common defines of the programs
  gl::Program uncovered_;
  gl::Program uncoveredInside_;  ///< for levels after the first
  gl::Program join_;
  gl::Program hidden_;
  std::vector<Vec4> lastTints_;
  gl::Buffer tintBuffer_;
  gl::Texture tints_;
};

}  // namespace catoptric::methods::perturbation
