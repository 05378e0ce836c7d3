// Errors of runs as tables, CSV and JSON.
#pragma once

#include <span>
#include <string>

#include "report/comparison.h"
#include "report/table.h"
#include "report/timings.h"

namespace catoptric::report {

/// One comparison, frame by frame, and the pooled row.
Table errorView(const RunComparison& comparison);
/// Reflective objects, pooled; no rows without the layers that tell.
Table objectView(const RunComparison& comparison);
/// Shares of the pooled error by class.
Table attributionView(const RunComparison& comparison);
/// A row for each comparison; with the mean time of its method and the ratio to that of what it is
/// compared with where `timings` has them.
Table errorSummary(std::span<const RunComparison> comparisons,
                   std::span<const TimingTable> timings = {});
/// method,against,frame,region,...; regions are frame, reflective, and the objects' ids; the pooled
/// rows have the frame "all".
std::string errorCsv(std::span<const RunComparison> comparisons);
/// method,against,frame,class,...
std::string attributionCsv(std::span<const RunComparison> comparisons);
/// [{"method", "against", "frames": [...], "pooled": {...}, "only_in_run", "only_in_reference"}];
/// an infinite PSNR is null.
std::string errorJson(std::span<const RunComparison> comparisons);

}  // namespace catoptric::report
