// Stability over time of a run against its reference, as a table, CSV and JSON.
#pragma once

#include <span>
#include <string>

#include "report/comparison.h"
#include "report/table.h"

namespace catoptric::report {

/// A row for all counted pixels and one for each reflective object. Without consecutive frames the
/// table has no rows, and a note says why.
Table motionView(const RunComparison& comparison);
/// CSV: method,against,frame,region,pixels,flicker,floor,flicker_mc,unmatched_percent,steady,
/// unsteady. A row per pair of frames (named by the later frame), per object, and for all frames.
std::string motionCsv(std::span<const RunComparison> comparisons);
/// A JSON object; null without consecutive frames.
std::string motionJson(const measure::MotionError& motion);

}  // namespace catoptric::report
