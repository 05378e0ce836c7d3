// Counts the fragments that a pass draws.
#pragma once

#include <cstdint>
#include <string_view>

#include "gl/objects.h"

namespace catoptric::gl {

/// Counts the fragments that pass the stencil and depth tests (and are not discarded) between
/// begin() and end(). Only one counter may be active at a time.
class FragmentCounter {
 public:
  FragmentCounter() = default;
  explicit FragmentCounter(std::string_view label);

  bool empty() const { return name_.id() == 0; }
  GLuint id() const { return name_.id(); }
  void begin() const;
  void end() const;
  /// The count of the last begin()-end() pair. Waits for the GPU, so read it late.
  std::uint64_t read() const;

 private:
  Name<ObjectKind::Query> name_;
};

}  // namespace catoptric::gl
