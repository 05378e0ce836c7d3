// A frame that is worked on in bands: while all threads work on one band, the thread that has the
// device reads the next one and uploads the last.
#pragma once

#include <cstddef>
#include <functional>

#include "frame/steps.h"

namespace catoptric::methods {

/// Rows of a band of `width` samples: whole tiles of SampleTiles::kSize, one at least.
int rowsOfBand(int width);

/// What is done with a band, by its number. `read` of band b + 2 comes after `upload` of band b:
/// two bands' memory is enough.
struct BandSteps {
  std::function<void(std::size_t)> read;
  std::function<void(std::size_t)> work;  ///< beside the other two
  std::function<void(std::size_t)> upload;
};

struct BandSeconds {
  double read = 0.0;
  double work = 0.0;  ///< the rest of the time
  double upload = 0.0;
};

/// Does all steps of all bands; waits for the device in the end. The times are left to the caller.
BandSeconds runBands(std::size_t count, const BandSteps& steps, frame::StepTimer& timer);

}  // namespace catoptric::methods
