// Converts layers of a frame to pictures.
#pragma once

#include <string>
#include <vector>

#include "image/image.h"
#include "report/figure.h"

namespace catoptric::report {

/// The names of a frame's layers other than its colours R G B A, in the frame's order. These are
/// the names of its channels; three channels N.X, N.Y, N.Z form one layer "N".
std::vector<std::string> layerNames(const image::Image& frame);

/// The layers of a frame that `name` stands for: the layer of this name, those of a group ("mask":
/// all of mask.*), or the layer that a config requests by this name ("cluster": id.cluster). Throws
/// UsageError, which begins with `file`, if there are none.
std::vector<std::string> layersNamed(const image::Image& frame, const std::string& name,
                                     const std::string& file);

/// The colour of an object's or cluster's number, the same in all pictures; black for 0.
Colour colourOfId(float id);

/// A picture of a layer. id.*: one colour per number. N: (n + 1) / 2. Z: white for the nearest
/// sample of the frame, half of that at twice the distance, black for the background. Layers of
/// three colours: as the preview. Other layers: 0 is black, 1 is white. Values that are not finite
/// are magenta.
Rgb8 layerPicture(const image::Image& frame, const std::string& layer);

}  // namespace catoptric::report
