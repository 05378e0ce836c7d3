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
  std::string name;  ///< beside one of its points; where there is no room, above the chart
  std::vector<ChartPoint> points;
  bool joined = false;  ///< lines connect consecutive points
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

/// Several charts in one file, one below the other.
std::string toSvg(const std::vector<Chart>& charts, int width = 720, int height = 420);

}  // namespace catoptric::study
