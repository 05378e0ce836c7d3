// A sweep: measures every combination of some options' values and compares time and error of each.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "report/table.h"
#include "study/bench.h"
#include "study/chart.h"
#include "study/trade.h"

namespace catoptric::study {

struct SweepRequest {
  std::string name;  ///< name of the config
  std::vector<Point> points;
  std::vector<std::string> metrics = {
      "L1_8bit"};       ///< the first one is used for the trade-off with time
  std::string against;  ///< method or folder
  std::string ratioTo;  ///< ratios refer to the first point of this method in each group; empty: to
                        ///< the first point
  TimeKind time;        ///< the time of ratios and marks
};

struct SweepPoint {
  Setting setting;
  int number = 0;  ///< counted from 1
  std::string failure;
  Ratio ratio;           ///< time relative to the group's reference point
  double seconds = 0.0;  ///< the request's time; 0: not measured
  double first = 0.0;    ///< seconds of the first frame, of a steady one, of the mean; 0: not known
  double steady = 0.0;
  double mean = 0.0;
  double reflection = 0.0;  ///< seconds of a steady frame's own steps: TimeKind::Of::Reflection
  double worstSeconds = 0.0;
  int worstSecondsFrame = 0;
  std::map<std::string, double> steps;   ///< seconds per frame
  std::map<std::string, double> errors;  ///< pooled, by error measure
  std::map<std::string, double> least;   ///< of the best frame
  double uncertainty = 0.0;              ///< of the reference, in the first error measure
  double handedOn = 0.0;  ///< share of the frames' samples that another method or rays render
  std::map<std::string, std::pair<int, double>> worst;  ///< frame and error, by error measure
  Judged judged;                                        ///< Judged::by is an index into `points`
  std::vector<int> sameAs;                              ///< numbers of points with identical pixels

  /// Whether its error, in the first measure, may be that of the reference alone.
  bool withinUncertainty(const std::string& metric) const {
    const auto error = errors.find(metric);
    return uncertainty > 0.0 && error != errors.end() && error->second <= uncertainty;
  }
};

struct SweepResult {
  SweepRequest request;
  std::vector<SweepPoint> points;
  std::vector<int> frames;  ///< the frames of the first group
  std::vector<std::string> notes;
};

/// Measures everything that is not known yet, as far as the bench has time. Throws StudyStopped;
/// finished measurements are kept.
void runSweep(Bench& bench, const SweepRequest& request, const std::vector<Setting>& settings);
/// Computes the result from the stored measurements.
SweepResult evaluateSweep(Bench& bench, const SweepRequest& request,
                          const std::vector<Setting>& settings);

/// One row per point.
report::Table sweepTable(const SweepResult& result);
std::string sweepCsv(const SweepResult& result);
std::string sweepJson(const SweepResult& result, const std::string& context);
std::vector<Chart> sweepCharts(const SweepResult& result);
/// A self-contained page with the curves, the table and a description of the measurement.
std::string sweepPage(const SweepResult& result, const std::string& context);

/// Writes points.csv, sweep.json, table.md, table.tex, tradeoff.svg, report.html and samples.csv to
/// the bench's folder. `context`: JSON that describes the machine.
void writeSweep(const Bench& bench, const SweepResult& result, const std::string& context);

}  // namespace catoptric::study
