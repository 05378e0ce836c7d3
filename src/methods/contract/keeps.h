// What a method keeps of a frame to save time in the next one. Times of such a method hold only for
// consecutive frames.
#pragma once

#include <string>

#include "methods/contract/method.h"

namespace catoptric::methods {

/// The interface of methods that keep something; the others do not have it.
class KeepsFrames {
 public:
  virtual ~KeepsFrames() = default;
  /// For example "images of impostors".
  virtual std::string keeps() const = 0;
};

/// What the method keeps; empty: nothing.
inline std::string keepsOf(const Method& method) {
  const auto* own = dynamic_cast<const KeepsFrames*>(&method);
  return own == nullptr ? "" : own->keeps();
}

}  // namespace catoptric::methods
