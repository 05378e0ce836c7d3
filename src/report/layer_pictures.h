// Layers of a frame as pictures to look at.
#pragma once

#include <string>
#include <vector>

#include "image/image.h"
#include "report/figure.h"

namespace catoptric::report {

/// Layers of a frame beside its colours R G B A: names of its channels, without the last part
/// where it is one of three (N.X, N.Y, N.Z: "N"). In the frame's order.
std::vector<std::string> layerNames(const image::Image& frame);

/// The layers of a frame that `name` means: itself, those of a group ("mask": all of mask.*), or
/// as a config asks for it ("cluster": id.cluster). Throws UsageError, beginning with `file`, when
/// there are none.
std::vector<std::string> layersNamed(const image::Image& frame, const std::string& name,
                                     const std::string& file);

/// Colour of a number of an object or a cluster: the same in all pictures; black for 0.
Colour colourOfId(float id);

/// id.*: a colour per number. N: (n + 1) / 2. Z: the nearest of the frame white, twice as far half
/// that; black where nothing is. Colours of three: as the preview. Others: 0 black, 1 white.
/// Magenta where a value is not finite.
Rgb8 layerPicture(const image::Image& frame, const std::string& layer);

}  // namespace catoptric::report
