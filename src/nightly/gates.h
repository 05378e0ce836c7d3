// What a night may differ by from what was accepted, before it is a regression.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/json.h"

namespace catoptric::nightly {

/// Shares of what is compared with; all chosen by us, and all may be changed by a suite.
struct Gates {
  double time = 0.05;    ///< longer than the accepted and the anchor build, as a share
  double memory = 0.20;  ///< more peak memory than the accepted build, as a share
  double disk = 0.50;    ///< larger frames than the accepted ones, as a share
  double again = 0.02;   ///< how far tonight's build may differ from itself
  /// Pictures that differ by less are within their limits: rounding of another machine.
  std::map<std::string, double> picture = {
      {"L1_8bit", 0.05},         ///< mean difference, display steps
      {"max_8bit", 8.0},         ///< largest difference, display steps
      {"over_percent", 0.1},     ///< pixels that differ by more than 0.01, percent
      {"hdr_flip_mean", 0.002},  ///< 0..1
      {"hdr_flip_q3", 0.05},     ///< weighted third quartile of HDR-FLIP, 0..1
      {"worst_tile", 1.0},       ///< mean difference in the worst 16 x 16 pixels, display steps
      {"worst_reflector", 0.25}  ///< mean difference on the worst reflector, display steps
  };
  /// Counters that may not rise by more than `watchRise`, besides those that must be 0.
  std::vector<std::string> watch = {"unclustered", "environment"};
  double watchRise = 0.10;
};

const config::Schema& gatesSchema();
/// `value` is checked against the schema already; null: the defaults.
Gates readGates(const config::Value& value);

}  // namespace catoptric::nightly
