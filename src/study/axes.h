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
  std::vector<std::vector<std::string>> values;  ///< each value has one text per name
  /// The method that has this option, by its name in the config; empty: the option applies to every
  /// method.
  std::string method;
};

/// Parses "NAME=a,b,c", "NAME=0..1:5" (equal steps) or "NAME=log:0.1..10:7" (even ratios). Throws
/// UsageError.
Axis parseAxis(const std::string& text);

/// Joins the axes that a --link "A,B" names into one axis. Throws UsageError if their lengths
/// differ.
void linkAxes(std::vector<Axis>& axes, const std::string& link);

/// One axis for each option of a method that trades accuracy for time. Its values are those of the
/// schema (config::Field::trade) and the option's present value. `name`: the method's name in the
/// config; `effective`: its options, with defaults.
std::vector<Axis> automaticAxes(const std::string& name, const config::Schema& schema,
                                const config::Value& effective);

/// Selects combinations by comparisons that are joined by "&&": "rays<=16 && probes>rays". Each
/// compares two names or numbers. The part of a name before its last point may be omitted if only
/// one axis has a name that ends in the rest.
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

/// One combination: a method with values of options.
struct Point {
  std::string method;
  Settings settings;    ///< all except the program, in the order of the axes
  std::string program;  ///< empty: the running program
  std::string
      group;  ///< the settings that all methods have in common; points are compared within a group
};

/// Makes a point for every method and each combination of the axes that apply to it. `methods`:
/// names in the config. Throws UsageError for axes that apply to none of them.
std::vector<Point> makePoints(const std::vector<std::string>& methods,
                              const std::vector<Axis>& axes,
                              const std::vector<Condition>& conditions);

/// For example "level_error=0.75 rays=8": names without the part before their last point.
std::string settingsText(const Settings& settings);

}  // namespace catoptric::study
