// Curves as SVG: small, static, readable in light and dark surroundings, without a script.
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
  std::optional<Interval> xInterval;  ///< a line through the point
  std::optional<double> yWorst;       ///< a thin line up to it
  Mark mark = Mark::Front;            ///< filled; dominated: hollow; unclear: half transparent
  std::string label;                  ///< beside the point, where there is room
  std::string title;                  ///< shown by a browser when pointed at
};

struct ChartSeries {
  std::string name;
  std::vector<ChartPoint> points;
  bool joined = false;  ///< a line from point to point
};

struct Chart {
  std::string title;
  std::string xTitle;
  std::string yTitle;
  bool xLog = false;
  bool yLog = false;
  bool fromZero = true;    ///< of linear axes
  bool showFront = false;  ///< a stepped line along all points with Mark::Front
  std::vector<ChartSeries> series;
};

/// A whole SVG file; `width` of the picture in pixels.
std::string toSvg(const Chart& chart, int width = 720, int height = 420);

/// Several, one below the other, in one file.
std::string toSvg(const std::vector<Chart>& charts, int width = 720, int height = 420);

}  // namespace catoptric::study
