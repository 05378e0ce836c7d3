#include "raster/draw.h"

#include <algorithm>
#include <utility>

namespace catoptric::raster {

ObjectSet ObjectSet::only(std::vector<int> ids) {
  ObjectSet set;
  set.ids_ = std::move(ids);
  std::ranges::sort(set.ids_);
  set.complement_ = false;
  return set;
}

ObjectSet ObjectSet::without(std::vector<int> ids) {
  ObjectSet set = only(std::move(ids));
  set.complement_ = true;
  return set;
}

bool ObjectSet::has(int id) const {
  return std::ranges::binary_search(ids_, id) != complement_;
}

}  // namespace catoptric::raster
