// A sweep: every combination of some options' values, measured and compared: what each setting
// costs and what it is worth.
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
  std::string name;  ///< of the config
  std::vector<Point> points;
  std::vector<std::string> metrics = {"L1_8bit"};  ///< the first one is traded against time
  std::string against;                             ///< method or folder
  std::string ratioTo;  ///< the first point of this method in each group is the measure of the
                        ///< others; empty: the first point
  Measurement::Clock clock = Measurement::Clock::Wall;
};

struct SweepPoint {
  Setting setting;
  int number = 0;  ///< from 1
  std::string failure;
  Ratio ratio;           ///< to the group's measure
  double seconds = 0.0;  ///< of a frame, mean; 0: not measured
  double worstSeconds = 0.0;
  int worstSecondsFrame = 0;
  std::map<std::string, double> steps;                  ///< seconds of a frame
  std::map<std::string, double> errors;                 ///< pooled, by measure
  std::map<std::string, std::pair<int, double>> worst;  ///< frame and error, by measure
  Judged judged;                                        ///< `by`: an index of points
  std::vector<int> sameAs;                              ///< numbers of points with equal pixels
};

struct SweepResult {
  SweepRequest request;
  std::vector<SweepPoint> points;
  std::vector<int> frames;  ///< of the first group
  std::vector<std::string> notes;
};

/// Measures what is not known yet. Throws StudyStopped; what was finished is kept.
void runSweep(Bench& bench, const SweepRequest& request, const std::vector<Setting>& settings);
/// From what is known.
SweepResult evaluateSweep(Bench& bench, const SweepRequest& request,
                          const std::vector<Setting>& settings);

/// A row for each point.
report::Table sweepTable(const SweepResult& result);
std::string sweepCsv(const SweepResult& result);
std::string sweepJson(const SweepResult& result, const std::string& context);
std::vector<Chart> sweepCharts(const SweepResult& result);
/// A page of its own, with the curves, the table and how it was measured.
std::string sweepPage(const SweepResult& result, const std::string& context);

/// Writes points.csv, sweep.json, table.md, table.tex, tradeoff.svg and report.html into the
/// bench's folder, and samples.csv. `context`: JSON of the machine.
void writeSweep(const Bench& bench, const SweepResult& result, const std::string& context);

}  // namespace catoptric::study
