// Traces rays from samples of a G-buffer with Embree, row by row, for diagnoses.
#pragma once

#include <cstddef>
#include <vector>

#include "core/parallel.h"
#include "trace/embree/trace_scene.h"

namespace catoptric::methods {

/// Rays of one row and their hits.
struct AskedRays {
  std::vector<trace::Ray> rays;
  std::vector<trace::Hit> hits;

  void ask(const trace::TraceScene& trace) {
    hits.resize(rays.size());
    trace.intersectSerial(rays, hits, true);
  }
};

/// The sum of `ofRow(y, asked)` over all rows, in parallel; each row starts with `asked` empty.
template <class Counts, class OfRow>
Counts sumOverRows(std::size_t rows, OfRow&& ofRow) {
  std::vector<Counts> counts(rows);
  parallelFor(rows, 8, [&](std::size_t begin, std::size_t end) {
    AskedRays asked;
    for (std::size_t y = begin; y < end; ++y) {
      asked.rays.clear();
      counts[y] = ofRow(y, asked);
    }
  });
  Counts sum{};
  for (const Counts& row : counts) sum += row;
  return sum;
}

}  // namespace catoptric::methods
