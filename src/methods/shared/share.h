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

/// Shows a method only the samples that another one left (FrameOutput::left), and keeps their
/// masks.
class LeftSamples {
 public:
  LeftSamples() = default;
  LeftSamples(const raster::GBuffer& gbuffer, bool masks);

  /// From here to end(), the G-buffer has the object ids of the left samples alone; `left` holds
  /// those of all. Clears the masks.
  void begin(raster::GBuffer& gbuffer, gl::Texture& left) const;
  /// Adds the bits that masks had at begin(), and kMaskFallback for the samples that were left.
  void end(raster::GBuffer& gbuffer, gl::Texture& left);

 private:
  gl::Texture before_;  ///< masks at begin(); empty without masks
  gl::Program merge_;
};

}  // namespace catoptric::methods
