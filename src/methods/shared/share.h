// A method's share of a frame in which several methods fill reflectors: while it renders, samples
// of the others' reflectors have stencil values that no pass over reflective samples tests for.
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
  /// `own`: the method's reflectors among so many objects.
  Share(std::size_t objects, const frame::ObjectSet& own);

  /// Hides the samples of others' reflectors, all being shown.
  void hideOthers(const raster::GBuffer& gbuffer) const;
  /// Shows all again.
  void showAll(const raster::GBuffer& gbuffer) const;
  /// Samples of reflectors that are not hidden.
  std::uint64_t countShown(const raster::GBuffer& gbuffer) const;

 private:
  gl::Program others_;
  gl::Program all_;
  gl::FragmentCounter counter_;
  gl::Buffer buffer_;
  gl::Texture own_;  ///< R8UI by object id
};

}  // namespace catoptric::methods
