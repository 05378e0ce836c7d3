// The values that a study varies: axes of options, and the points that they span.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "run/config/run_config.h"

namespace catoptric::study {

/// One option, or several that change together.
struct Axis {
  std::vector<std::string> names;                ///< as for --set, or "program"
  std::vector<std::vector<std::string>> values;  ///< of each value one text for each name
  /// The method whose option it is, by its name in the config; empty: every method has it.
  std::string method;
};

/// Parses "NAME=a,b,c", "NAME=0..1:5" (even steps) or "NAME=log:0.1..10:7" (even ratios). Throws
/// UsageError.
Axis parseAxis(const std::string& text);

/// Joins the axes that a --link "A,B" names. Throws UsageError when their lengths differ.
void linkAxes(std::vector<Axis>& axes, const std::string& link);

/// The options of a method that trade accuracy for time, with the values of its schema and the one
/// that it has. `name`: in the config; `effective`: its options, defaults filled in.
std::vector<Axis> automaticAxes(const std::string& name, const config::Schema& schema,
                                const config::Value& effective);

/// What of the combinations is taken: comparisons joined by "&&", each of a name or number with a
/// name or number: "rays<=16 && probes>rays". A name may leave out what comes before its last
/// point where only one axis ends so.
class Condition {
 public:
  /// Throws UsageError with the nearest name.
  Condition(const std::string& text, const std::vector<Axis>& axes);
  bool holds(const std::map<std::string, std::string>& settings) const;

 private:
  struct Comparison {
    std::string left;
    std::string sign;
    std::string right;
  };
  std::string text_;
  std::vector<Comparison> all_;
};

using Settings = std::vector<std::pair<std::string, std::string>>;

/// One combination: a method with values.
struct Point {
  std::string method;
  Settings settings;    ///< all but the program, in the order of the axes
  std::string program;  ///< empty: this one
  std::string group;    ///< what all methods have in common: points are compared within a group
};

/// Every method with each combination of the axes that concern it. `methods`: names in the config.
/// Throws UsageError for axes that concern none of them.
std::vector<Point> makePoints(const std::vector<std::string>& methods,
                              const std::vector<Axis>& axes,
                              const std::vector<Condition>& conditions);

/// "level_error=0.75 rays=8": names without what comes before their last point.
std::string settingsText(const Settings& settings);

}  // namespace catoptric::study
