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

}  // namespace catoptric::methods
