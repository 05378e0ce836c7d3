// A set of objects, given by their index in Geometry::objects.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace catoptric::frame {

class ObjectSet {
 public:
  /// Contains every object.
  ObjectSet() = default;
  /// Contains object i if `members[i]` is true; false beyond the end of `members`.
  explicit ObjectSet(std::vector<bool> members) : all_(false), members_(std::move(members)) {}

  bool all() const { return all_; }
  bool contains(int objectIndex) const {
    const auto index = static_cast<std::size_t>(objectIndex);
    return all_ || (index < members_.size() && members_[index]);
  }
  bool operator==(const ObjectSet&) const = default;

 private:
  bool all_ = true;
  std::vector<bool> members_;
};

}  // namespace catoptric::frame
