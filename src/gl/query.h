// Counts what a pass draws.
#pragma once

#include <cstdint>
#include <string_view>

#include "gl/objects.h"

namespace catoptric::gl {

/// Number of fragments that pass the stencil and depth tests (and are not discarded) between begin
/// and end. Only one may be counting at a time.
class FragmentCounter {
 public:
  FragmentCounter() = default;
  explicit FragmentCounter(std::string_view label);

  bool empty() const { return name_.id() == 0; }
  GLuint id() const { return name_.id(); }
  void begin() const;
  void end() const;
  /// Of the last begin-end pair; waits for the device: read it late.
  std::uint64_t read() const;

 private:
  Name<ObjectKind::Query> name_;
};

}  // namespace catoptric::gl
