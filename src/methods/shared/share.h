// Restricts a method to its reflectors when several methods shade a frame: while it renders,
// samples of other reflectors have stencil values that no pass over reflective samples tests for.
#pragma once

#include <cstddef>
#include <cstdint>

#include "frame/object_set.h"
#include "gl/objects.h"
#include "gl/query.h"
#include "gl/shader.h"
#include "raster/gbuffer.h"

namespace catoptric::methods {

class Share {
 public:
  Share() = default;
  /// `own`: the method's reflectors, among `objects` objects.
  Share(std::size_t objects, const frame::ObjectSet& own);

  /// Hides the samples of other reflectors; all samples must be visible before.
  void hideOthers(const raster::GBuffer& gbuffer) const;
  /// Makes all samples visible again.
  void showAll(const raster::GBuffer& gbuffer) const;
  /// Number of samples of visible reflectors.
  std::uint64_t countShown(const raster::GBuffer& gbuffer) const;

 private:
  gl::Program others_;
  gl::Program all_;
  gl::FragmentCounter counter_;
  gl::Buffer buffer_;
  gl::Texture own_;  ///< R8UI, indexed by object id
};

/// While it exists, the G-buffer has the object ids of the samples alone that a method left
/// (FrameOutput::left), and `left` holds those of all.
class OnlyLeftSamples {
 public:
  OnlyLeftSamples(raster::GBuffer& gbuffer, gl::Texture& left);
  ~OnlyLeftSamples();
  OnlyLeftSamples(const OnlyLeftSamples&) = delete;
  OnlyLeftSamples& operator=(const OnlyLeftSamples&) = delete;

 private:
  gl::Texture& shown_;
  gl::Texture& others_;
};

/// Keeps the masks of a method while another one renders the samples that it left.
class MasksBefore {
 public:
  MasksBefore() = default;
  explicit MasksBefore(const raster::GBuffer& gbuffer);

  /// Copies the masks, and clears them.
  void keep(const raster::GBuffer& gbuffer) const;
  /// Adds what was kept, and kMaskFallback for the samples that were left.
  void add(const raster::GBuffer& gbuffer, const gl::Texture& left);

 private:
  gl::Texture before_;
  gl::Program merge_;
};

}  // namespace catoptric::methods
