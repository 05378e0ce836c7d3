// What stands in a chart's SVG, of points that are made up.
#include "study/chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace catoptric::study {
namespace {

using testing::HasSubstr;
using testing::Not;

int countOf(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

Chart chartOf(const std::vector<std::pair<double, double>>& points) {
  Chart chart;
  chart.series.push_back({"traced", {}, false});
  for (const auto& [x, y] : points) {
    ChartPoint point;
    point.x = x;
    point.y = y;
    chart.series.back().points.push_back(point);
  }
  return chart;
}

TEST(Chart, AxesFitThePoints) {
  const std::string svg = toSvg(chartOf({{100.0, 2.0}, {110.0, 3.0}}));
  EXPECT_THAT(svg, HasSubstr(">105</text>"));
  EXPECT_THAT(svg, Not(HasSubstr(">0</text>")));
  EXPECT_THAT(toSvg(chartOf({{1.0, 2.0}, {110.0, 3.0}})), HasSubstr(">0</text>"));
}

TEST(Chart, AnErrorOfZeroLiesOnALogarithmicAxis) {
  Chart chart = chartOf({{1.0, 0.0}, {10.0, 0.1}, {100.0, 10.0}});
  chart.xLog = chart.yLog = true;
  const std::string svg = toSvg(chart, 720, 420);
  EXPECT_THAT(svg, HasSubstr(">0</text>"));
  EXPECT_THAT(svg, HasSubstr("cy=\"370.0\""));  // on the axis, 50 above the lower edge
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(Chart, WithoutAnErrorTheAxisIsLinear) {
  Chart chart = chartOf({{1.0, 0.0}, {10.0, 0.0}});
  chart.xLog = chart.yLog = true;
  EXPECT_THAT(toSvg(chart), HasSubstr(">0</text>"));
}

TEST(Chart, BarsGoInBothDirections) {
  Chart chart = chartOf({{1.0, 1.0}, {10.0, 10.0}});
  const int lines = countOf(toSvg(chart), "class=\"thin s0\"");
  chart.series[0].points[0].xInterval = Interval{0.8, 1.2};
  EXPECT_EQ(countOf(toSvg(chart), "class=\"thin s0\""), lines + 3);  // with two caps
  chart.series[0].points[0].yInterval = Interval{0.5, 2.0};
  EXPECT_EQ(countOf(toSvg(chart), "class=\"thin s0\""), lines + 6);
}

TEST(Chart, SeriesAreNamedAtTheirPoints) {
  Chart chart = chartOf({{1.0, 1.0}, {10.0, 10.0}});
  chart.series[0].points[1].label = "rays=8";
  EXPECT_THAT(toSvg(chart), HasSubstr(">traced rays=8</text>"));
  // Where no point has room, above the chart
  for (int i = 0; i < 4000; ++i) {
    ChartPoint point;
    point.x = 1.0 + 9.0 * (i % 80) / 79.0;
    point.y = 1.0 + 9.0 * (i / 80) / 49.0;
    chart.series[0].points.push_back(point);
  }
  EXPECT_EQ(countOf(toSvg(chart), ">traced</text>"), 1);
}

TEST(Chart, TheFrontLeavesOutWhatIsWorse) {
  Chart chart = chartOf({{1.0, 3.0}, {2.0, 5.0}, {3.0, 1.0}});
  chart.showFront = true;
  const std::string svg = toSvg(chart);
  const std::string path = svg.substr(svg.find("<path d=\"M"), 60);
  EXPECT_EQ(countOf(path, "H"), 1) << path;  // one step, from the first to the last
  EXPECT_THAT(svg, HasSubstr("Pareto front"));
}

TEST(Chart, ChartsBesideEachOtherHaveTheSameScales) {
  std::vector<Chart> charts = {chartOf({{1.0, 2.0}, {2.0, 3.0}}), chartOf({{50.0, 40.0}})};
  for (Chart& chart : charts) {
    chart.showFront = true;
    chart.series[0].name.clear();
    for (ChartPoint& point : chart.series[0].points) point.label = "own";
  }
  const std::string beside = toSvg(charts, 450, 250, 2);
  EXPECT_THAT(beside, HasSubstr("viewBox=\"0 0 900 250\""));
  EXPECT_THAT(beside, HasSubstr("translate(450 0)"));
  EXPECT_EQ(countOf(beside, ">50</text>"), 2);
  EXPECT_EQ(countOf(beside, "name f0"), 1 + 2);  // of the front; its last point
  EXPECT_THAT(beside, Not(HasSubstr("Pareto front")));
  const std::string below = toSvg(charts, 450, 250);
  EXPECT_THAT(below, HasSubstr("viewBox=\"0 0 450 500\""));
  EXPECT_EQ(countOf(below, ">50</text>"), 1);
}

}  // namespace
}  // namespace catoptric::study
