// The limits within which a night may differ from the accepted state without being a regression.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/json.h"

namespace catoptric::nightly {

/// Limits as fractions of the accepted values. The defaults are our choice; a suite may change
/// them.
struct Gates {
  double time = 0.05;     ///< additional time, compared with the accepted and the anchor build
  double memory = 0.20;   ///< additional peak memory, compared with the accepted build
  double disk = 0.50;     ///< additional size of frames, compared with the accepted frames
  double flicker = 0.05;  ///< additional flicker against the reference frames, display steps
  double again = 0.02;    ///< largest time difference between two measurements of tonight's build
  /// Pictures whose differences stay below these limits pass; rounding on another machine causes
  /// such differences.
  std::map<std::string, double> picture = {
      {"L1_8bit", 0.05},         ///< mean difference, display steps
      {"max_8bit", 8.0},         ///< largest difference, display steps
      {"over_percent", 0.1},     ///< percent of pixels that differ by more than 0.01
      {"hdr_flip_mean", 0.002},  ///< 0..1
      {"hdr_flip_q3", 0.05},     ///< weighted third quartile of HDR-FLIP, 0..1
      {"worst_tile", 1.0},       ///< mean difference in the worst 16 x 16 pixels, display steps
      {"worst_reflector", 0.25}  ///< mean difference on the worst reflector, display steps
  };
  /// Counters that may rise by at most the fraction `watchRise`. Counters that must be 0 are not in
  /// this list.
  std::vector<std::string> watch = {"unclustered", "environment"};
  double watchRise = 0.10;
};

const config::Schema& gatesSchema();
/// `value` has been checked against the schema; null: the defaults.
Gates readGates(const config::Value& value);

}  // namespace catoptric::nightly
