// Errors of runs as tables, CSV and JSON.
#pragma once

#include <span>
#include <string>

#include "report/comparison.h"
#include "report/table.h"
#include "report/timings.h"

namespace catoptric::report {

/// One comparison: a row per frame, and a row of pooled errors.
Table errorView(const RunComparison& comparison);
/// Pooled errors of each reflective object; no rows without the layers that identify them.
Table objectView(const RunComparison& comparison);
/// Fractions of the pooled error, by class of pixels.
Table attributionView(const RunComparison& comparison);
/// A row per comparison. With `timings`, each row also has the median time of its method.
Table errorSummary(std::span<const RunComparison> comparisons,
                   std::span<const TimingTable> timings = {});
/// CSV: method,against,frame,region,...; regions are frame, reflective, elsewhere, and ids of
/// objects. Pooled rows have the frame "all".
std::string errorCsv(std::span<const RunComparison> comparisons);
/// CSV: method,against,frame,class,...
std::string attributionCsv(std::span<const RunComparison> comparisons);
/// JSON: [{"method", "against", "frames": [...], "pooled": {...}, "motion": {...},
/// "only_in_run", "only_in_reference"}]; an infinite PSNR is null.
std::string errorJson(std::span<const RunComparison> comparisons);

}  // namespace catoptric::report
