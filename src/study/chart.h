// Charts as SVG: small, static, readable on light and dark backgrounds, without a script.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "study/statistics.h"
#include "study/trade.h"

namespace catoptric::study {

struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
  std::optional<Interval> xInterval = {};  ///< drawn as an error bar
  std::optional<Interval> yInterval = {};
  Mark mark = Mark::Front;  ///< Front: filled; Dominated: hollow; Unclear: hollow, dashed
  std::string label = {};   ///< beside the point, if there is room
  std::string title = {};   ///< tooltip in a browser
};

struct ChartSeries {
  std::string name;  ///< beside one of its points; where there is no room, above the chart; empty:
                     ///< its points have their labels alone
  std::vector<ChartPoint> points;
  bool joined = false;                     ///< lines connect consecutive points
  std::optional<std::size_t> colour = {};  ///< 0 to 7; otherwise the number of the series
};

struct Chart {
  std::string title;
  std::string note = {};  ///< below the title
  std::string xTitle;
  std::string yTitle;
  bool xLog = false;  ///< values of 0 lie on the axis
  bool yLog = false;
  bool showFront = false;             ///< draws the Pareto front as a stepped line
  std::optional<double> xBound = {};  ///< drawn as a dashed line
  std::optional<double> yBound = {};
  std::vector<ChartSeries> series = {};
};

/// A complete SVG file; `width` and `height` in pixels.
std::string toSvg(const Chart& chart, int width = 720, int height = 420);

/// Several charts in one file, row by row; `width` and `height` of each. Those in several columns
/// have the same scales.
std::string toSvg(const std::vector<Chart>& charts, int width = 720, int height = 420,
                  int columns = 1);

}  // namespace catoptric::study
