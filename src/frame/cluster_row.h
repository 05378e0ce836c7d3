// What a method that clusters rays says of each cluster: a row of clusters.csv.
#pragma once

#include <cstdint>

namespace catoptric::frame {

struct ClusterRow {
  int object = 0;  ///< id of the reflector
  std::uint64_t samples = 0;
  bool planar = false;
  bool concave = false;
  int width = 0;  ///< of its depth image, texels
  int height = 0;
  std::uint64_t triangles = 0;  ///< drawn into it
  double displacement = 1.0;    ///< f of equation (1) [Wang2014]
};

}  // namespace catoptric::frame
