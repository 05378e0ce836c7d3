// Processes a frame in bands: while all threads work on one band, the thread with the GL context
// reads the next band and uploads the previous one.
#pragma once

#include <cstddef>
#include <functional>

#include "frame/steps.h"

namespace catoptric::methods {

/// Number of rows in a band of `width` samples: whole tiles of SampleTiles::kSize, at least one.
int rowsOfBand(int width);

/// The steps of a band; each gets the band's number. `read` of band b + 2 follows `upload` of band
/// b, so that memory for two bands suffices.
struct BandSteps {
  std::function<void(std::size_t)> read;
  std::function<void(std::size_t)> work;  ///< concurrent with the other two steps
  std::function<void(std::size_t)> upload;
};

struct BandSeconds {
  double read = 0.0;
  double work = 0.0;  ///< the time in which neither of the others ran
  double upload = 0.0;
};

/// Runs all steps of all bands and waits for the GPU at the end. The caller records the times.
BandSeconds runBands(std::size_t count, const BandSteps& steps, frame::StepTimer& timer);

}  // namespace catoptric::methods
