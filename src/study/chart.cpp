#include "study/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "report/html.h"

namespace catoptric::study {
namespace {

// Colours that stay apart for colour-blind eyes. [Okabe2008]
constexpr std::array<const char*, 8> kLight = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                               "#a07000", "#3a9bd6", "#6b6b6b", "#7a4fb5"};
constexpr std::array<const char*, 8> kDark = {"#5bb4ec", "#ff8a3d", "#2fcf9f", "#eba3cb",
                                              "#e8b53a", "#8fd0ff", "#b5b5b5", "#b795ee"};

constexpr double kLeft = 64.0;  // pixels, for the numbers of the axis
constexpr double kRight = 24.0;
constexpr double kTop = 58.0;       // title and note
constexpr double kSmallTop = 34.0;  // title
constexpr double kBottom = 50.0;
constexpr double kMargin = 0.06;  // of the values' range, beside them
constexpr double kLetter = 6.1;   // mean width of a letter of 11 pixels

std::string px(double value) {
  return report::fixedText(value, 1);
}

/// Shortest text of a tick: 0.5, 20, 1500.
std::string tickText(double value) {
  for (int decimals = 0; decimals < 6; ++decimals) {
    std::string text = report::fixedText(value, decimals);
    if (std::abs(std::stod(text) - value) <= 1e-9 * std::abs(value)) return text;
  }
  return report::exactText(value);
}

/// One axis: from values to pixels, and its ticks.
class Scale {
 public:
  /// `least` and `most`: of the positive values where the axis is logarithmic; `zero`: there are
  /// others, which lie at its low end.
  Scale(double least, double most, bool log, bool zero, double pixelLow, double pixelHigh)
      : log_(log && least > 0.0 && least <= most), pixelLow_(pixelLow), pixelHigh_(pixelHigh) {
    if (!(least <= most)) least = 0.0, most = 1.0;
    low_ = log_ ? std::log10(least) : least;
    high_ = log_ ? std::log10(most) : most;
    const double range = high_ - low_;
    const double margin = range > 0.0 ? kMargin * range : log_ ? 0.1 : std::max(0.1 * most, 0.1);
    low_ -= log_ && zero ? 3.0 * margin : margin;
    high_ += margin;
    if (!log_ && least >= 0.0) low_ = std::max(low_, 0.0);
    makeTicks();
    if (log_ && zero) {
      std::erase_if(ticks_, [&](double tick) { return std::log10(tick) < low_ + 2.0 * margin; });
      ticks_.push_back(0.0);
    }
  }

  double at(double value) const {
    if (log_ && value <= 0.0) return pixelLow_;
    const double place = log_ ? std::log10(value) : value;
    return pixelLow_ + (place - low_) / (high_ - low_) * (pixelHigh_ - pixelLow_);
  }
  const std::vector<double>& ticks() const { return ticks_; }

 private:
  void makeTicks() {
    if (log_) {
      // 1, 2, 5 of each power of ten; of few powers all of them, of a part of one even steps
      for (int power = static_cast<int>(std::floor(low_)); power <= high_; ++power)
        for (const double digit : {1.0, 2.0, 5.0}) {
          const double value = digit * std::pow(10.0, power);
          if (std::log10(value) >= low_ && std::log10(value) <= high_ &&
              (digit == 1.0 || high_ - low_ < 2.2))
            ticks_.push_back(value);
        }
      if (ticks_.size() >= 2) return;
      ticks_.clear();
    }
    const double low = log_ ? std::pow(10.0, low_) : low_;
    const double high = log_ ? std::pow(10.0, high_) : high_;
    const double raw = (high - low) / 5.0;
    const double power = std::pow(10.0, std::floor(std::log10(raw)));
    double step = power;
    for (const double digit : {1.0, 2.0, 2.5, 5.0, 10.0})
      if (digit * power <= raw * 1.3) step = digit * power;
    for (auto i = static_cast<long long>(std::ceil(low / step));
         static_cast<double>(i) * step <= high; ++i)
      ticks_.push_back(static_cast<double>(i) * step);
  }

  bool log_;
  double low_ = 0.0;
  double high_ = 1.0;
  double pixelLow_;
  double pixelHigh_;
  std::vector<double> ticks_;
};

struct Range {
  bool log = false;  ///< only positive values count
  bool zero = false;
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  void add(double value) {
    zero = zero || value <= 0.0;
    if (log && value <= 0.0) return;
    least = std::min(least, value);
    most = std::max(most, value);
  }
};

struct Box {
  double x0, y0, x1, y1;
  bool meets(const Box& other) const {
    return x0 < other.x1 && other.x0 < x1 && y0 < other.y1 && other.y0 < y1;
  }
};

std::string styles() {
  const auto scheme = [](const std::array<const char*, 8>& colours, const char* ink,
                         const char* soft, const char* grid, const char* paper) {
    std::string text = std::string(".paper{fill:") + paper + "}.ink{fill:" + ink +
                       "}.soft{fill:" + soft + "}.grid{stroke:" + grid + "}.axis{stroke:" + soft +
                       "}.front{stroke:" + soft + "}.hole{fill:" + paper + "}";
    for (std::size_t i = 0; i < colours.size(); ++i) {
      const std::string name = std::to_string(i);
      text += ".f" + name + "{fill:" + colours[i] + "}.s" + name + "{stroke:" + colours[i] + "}";
    }
    return text;
  };
  return "<style>text{font:11px system-ui,'DejaVu Sans',sans-serif}.title{font-size:14px;"
         "font-weight:600}.hole{stroke-width:1.6}.line{fill:none;stroke-width:1.6}.thin{fill:none;"
         "stroke-width:1.1}.name{font-weight:600}.grid{stroke-width:1}" +
         scheme(kLight, "#1c1c1c", "#666", "#e6e6e6", "#fff") +
         "@media(prefers-color-scheme:dark){" +
         scheme(kDark, "#e8e8e8", "#a8a8a8", "#333", "#16181b") + "}</style>\n";
}

/// Draws one chart with its upper left corner at (0, 0).
class Drawing {
 public:
  /// `scaledBy`: the charts whose points the axes fit; `small`: one of several beside each other.
  Drawing(const Chart& chart, std::span<const Chart> scaledBy, double width, double height,
          bool small)
      : chart_(chart),
        small_(small),
        width_(width),
        top_(small ? kSmallTop : kTop),
        bottom_(height - kBottom),
        right_(width - rightMargin(chart)),
        x_(makeScale(scaledBy, true, kLeft, right_)),
        y_(makeScale(scaledBy, false, bottom_, top_)) {}

  std::string text() {
    frame();
    bounds();
    if (chart_.showFront) front();
    for (std::size_t s = 0; s < chart_.series.size(); ++s) series(s);
    labels();
    return out_;
  }

 private:
  /// Curves that end at the chart's right have their names there.
  static bool namesAtEnd(const Chart& chart) {
    double most = -std::numeric_limits<double>::infinity();
    for (const ChartSeries& series : chart.series)
      for (const ChartPoint& point : series.points) most = std::max(most, point.x);
    return std::ranges::all_of(chart.series, [&](const ChartSeries& series) {
      return series.joined && (series.points.empty() || series.points.back().x == most);
    });
  }
  static double rightMargin(const Chart& chart) {
    if (!namesAtEnd(chart)) return kRight;
    std::size_t longest = 0;
    for (const ChartSeries& series : chart.series) longest = std::max(longest, series.name.size());
    return kRight + kLetter * 1.1 * static_cast<double>(longest);
  }

  static Scale makeScale(std::span<const Chart> charts, bool ofX, double low, double high) {
    Range range;
    range.log = ofX ? charts.front().xLog : charts.front().yLog;
    for (const Chart& chart : charts) {
      for (const ChartSeries& series : chart.series)
        for (const ChartPoint& point : series.points) {
          range.add(ofX ? point.x : point.y);
          if (const auto& interval = ofX ? point.xInterval : point.yInterval) {
            range.add(interval->low);
            range.add(interval->high);
          }
        }
      if (const auto& bound = ofX ? chart.xBound : chart.yBound) range.add(*bound);
    }
    return {range.least, range.most, range.log, range.zero, low, high};
  }

  void put(double x, double y, const std::string& text, const std::string& style,
           const char* anchor = "start") {
    out_ += "<text x=\"" + px(x) + "\" y=\"" + px(y) + "\" class=\"" + style + "\" text-anchor=\"" +
            anchor + "\">" + report::xmlText(text) + "</text>\n";
  }
  void line(double x0, double y0, double x1, double y1, const std::string& style) {
    out_ += "<line x1=\"" + px(x0) + "\" y1=\"" + px(y0) + "\" x2=\"" + px(x1) + "\" y2=\"" +
            px(y1) + "\" class=\"" + style + "\"/>\n";
  }

  void frame() {
    put(kLeft - 46.0, 22.0, chart_.title, "ink title");
    put(kLeft - 46.0, 41.0, chart_.note, "soft");
    for (const double tick : y_.ticks()) {
      line(kLeft, y_.at(tick), right_, y_.at(tick), "grid");
      put(kLeft - 7.0, y_.at(tick) + 4.0, tickText(tick), "soft", "end");
    }
    for (const double tick : x_.ticks()) {
      line(x_.at(tick), top_, x_.at(tick), bottom_, "grid");
      put(x_.at(tick), bottom_ + 16.0, tickText(tick), "soft", "middle");
    }
    line(kLeft, bottom_, right_, bottom_, "axis");
    put(0.5 * (kLeft + right_), bottom_ + 36.0, chart_.xTitle, "ink", "middle");
    const double middle = 0.5 * (top_ + bottom_);
    out_ += "<text transform=\"translate(15 " + px(middle) + ") rotate(-90)\" class=\"ink\" " +
            "text-anchor=\"middle\">" + report::xmlText(chart_.yTitle) + "</text>\n";
  }

  void bounds() {
    const std::string style = "thin front\" stroke-dasharray=\"5 4";
    if (chart_.yBound) {
      line(kLeft, y_.at(*chart_.yBound), right_, y_.at(*chart_.yBound), style);
      takeLine(kLeft, y_.at(*chart_.yBound), right_, y_.at(*chart_.yBound));
      put(right_ - 4.0, y_.at(*chart_.yBound) - 4.0, "bound", "soft", "end");
    }
    if (chart_.xBound) {
      line(x_.at(*chart_.xBound), top_, x_.at(*chart_.xBound), bottom_, style);
      takeLine(x_.at(*chart_.xBound), top_, x_.at(*chart_.xBound), bottom_);
      put(x_.at(*chart_.xBound) + 4.0, top_ + 10.0, "bound", "soft");
    }
  }

  /// Along the points of the front: as accurate as the last one that is fast enough.
  void front() {
    std::vector<const ChartPoint*> points;
    for (const ChartSeries& series : chart_.series)
      for (const ChartPoint& point : series.points)
        if (point.mark == Mark::Front) points.push_back(&point);
    std::sort(points.begin(), points.end(), [](const ChartPoint* a, const ChartPoint* b) {
      return a->x != b->x ? a->x < b->x : a->y < b->y;
    });
    std::string path;
    const ChartPoint* last = nullptr;
    for (const ChartPoint* point : points) {
      if (last != nullptr && point->y >= last->y) continue;
      const double x = x_.at(point->x);
      const double y = y_.at(point->y);
      path += (path.empty() ? "M" : "H") + px(x) + (path.empty() ? " " : "V") + px(y);
      if (last != nullptr) {
        takeLine(x_.at(last->x), y_.at(last->y), x, y_.at(last->y));
        takeLine(x, y_.at(last->y), x, y);
      }
      last = point;
    }
    if (path.empty()) return;
    out_ += "<path d=\"" + path + "\" class=\"line front\"/>\n";
    if (small_) return;
    line(right_ - 95.0, top_ - 11.0, right_ - 75.0, top_ - 11.0, "line front");
    put(right_ - 70.0, top_ - 7.0, "Pareto front", "soft");
  }

  /// An error bar with caps; one of the coordinates is that of the point.
  void bar(double x0, double y0, double x1, double y1, const std::string& style) {
    line(x0, y0, x1, y1, style);
    const double dx = x0 == x1 ? 3.0 : 0.0;
    const double dy = 3.0 - dx;
    line(x0 - dx, y0 - dy, x0 + dx, y0 + dy, style);
    line(x1 - dx, y1 - dy, x1 + dx, y1 + dy, style);
  }

  /// Labels keep off a line.
  void takeLine(double x0, double y0, double x1, double y1) {
    const double steps = std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0)) / 6.0) + 1.0;
    for (double i = 0.0; i <= steps; i += 1.0) {
      const double x = std::lerp(x0, x1, i / steps);
      const double y = std::lerp(y0, y1, i / steps);
      taken_.push_back({x - 1.0, y - 1.0, x + 1.0, y + 1.0});
    }
  }

  std::string colourOf(std::size_t s) const {
    return std::to_string(chart_.series[s].colour.value_or(s) % kLight.size());
  }

  void series(std::size_t s) {
    const ChartSeries& series = chart_.series[s];
    const std::string colour = colourOf(s);
    if (series.joined) {
      std::string path;
      for (std::size_t i = 0; i < series.points.size(); ++i) {
        const ChartPoint& point = series.points[i];
        path += (path.empty() ? "M" : "L") + px(x_.at(point.x)) + " " + px(y_.at(point.y));
        if (i > 0)
          takeLine(x_.at(series.points[i - 1].x), y_.at(series.points[i - 1].y), x_.at(point.x),
                   y_.at(point.y));
      }
      out_ += "<path d=\"" + path + "\" class=\"line s" + colour + "\"/>\n";
    }
    for (const ChartPoint& point : series.points) {
      const double x = x_.at(point.x);
      const double y = y_.at(point.y);
      out_ += "<g>";
      if (!point.title.empty()) out_ += "<title>" + report::xmlText(point.title) + "</title>";
      if (const auto& own = point.yInterval) {
        bar(x, y_.at(own->low), x, y_.at(own->high), "thin s" + colour);
        takeLine(x, y_.at(own->low), x, y_.at(own->high));
      }
      if (const auto& own = point.xInterval) {
        bar(x_.at(own->low), y, x_.at(own->high), y, "thin s" + colour);
        takeLine(x_.at(own->low), y, x_.at(own->high), y);
      }
      const std::string look = point.mark == Mark::Front ? "f" + colour
                               : point.mark == Mark::Unclear
                                   ? "hole s" + colour + "\" stroke-dasharray=\"2 1.5"
                                   : "hole s" + colour;
      out_ += "<circle cx=\"" + px(x) + "\" cy=\"" + px(y) + "\" r=\"4.2\" class=\"" + look +
              "\"/></g>\n";
      taken_.push_back({x - 5.0, y - 5.0, x + 5.0, y + 5.0});
    }
  }

  /// Puts a text beside a point where nothing stands. False: there is no such place.
  bool putBeside(const ChartPoint& point, const std::string& text, const std::string& style,
                 bool atEnd) {
    const double wide = kLetter * 1.08 * static_cast<double>(text.size());
    const double x = x_.at(point.x);
    const double y = y_.at(point.y);
    struct Side {
      double x, y;
      const char* anchor;
    };
    std::vector<Side> sides;
    if (atEnd)
      for (const double down : {4.0, -9.0, 17.0, -22.0, 30.0, -35.0, 43.0})
        sides.push_back({x + 9.0, y + down, "start"});
    for (const double far : {0.0, 12.0, 24.0}) {
      sides.push_back({x + 9.0, y - 7.0 - far, "start"});
      sides.push_back({x + 9.0, y + 15.0 + far, "start"});
      sides.push_back({x - 9.0, y - 7.0 - far, "end"});
      sides.push_back({x - 9.0, y + 15.0 + far, "end"});
    }
    for (const Side& side : sides) {
      const double from = side.anchor[0] == 's' ? side.x : side.x - wide;
      const Box box{from, side.y - 9.0, from + wide, side.y + 2.0};
      if (box.x0 < kLeft || box.x1 > width_ || box.y1 > bottom_ || box.y0 < top_ - 10.0 ||
          std::ranges::any_of(taken_, [&](const Box& other) { return box.meets(other); }))
        continue;
      put(side.x, side.y, text, style, side.anchor);
      taken_.push_back(box);
      return true;
    }
    return false;
  }

  /// The name of each series beside its last point, or another one; then the points' labels.
  void labels() {
    const bool atEnd = namesAtEnd(chart_);
    double left = kLeft;
    std::vector<const ChartPoint*> named(chart_.series.size());
    for (std::size_t s = 0; s < chart_.series.size(); ++s) {
      const ChartSeries& series = chart_.series[s];
      if (series.name.empty()) continue;
      const std::string style = "name f" + colourOf(s);
      for (auto point = series.points.rbegin(); point != series.points.rend(); ++point) {
        const std::string text = series.name + (point->label.empty() ? "" : " ") + point->label;
        if (!putBeside(*point, text, style, atEnd)) continue;
        named[s] = &*point;
        break;
      }
      if (named[s] != nullptr || series.points.empty()) continue;
      put(left, top_ - 4.0, series.name, style);
      left += 14.0 + kLetter * static_cast<double>(series.name.size());
    }
    for (std::size_t s = 0; s < chart_.series.size(); ++s)
      for (const ChartPoint& point : chart_.series[s].points)
        if (!point.label.empty() && &point != named[s])
          putBeside(point, point.label,
                    chart_.series[s].name.empty() && point.mark == Mark::Front
                        ? "name f" + colourOf(s)
                        : "soft",
                    false);
  }

  const Chart& chart_;
  bool small_;
  double width_;
  double top_;  ///< of the axes, like bottom_ and right_
  double bottom_;
  double right_;
  Scale x_;
  Scale y_;
  std::vector<Box> taken_;
  std::string out_;
};

}  // namespace

std::string toSvg(const std::vector<Chart>& charts, int width, int height, int columns) {
  const int rows = (static_cast<int>(charts.size()) + columns - 1) / columns;
  const std::string wide = std::to_string(columns * width);
  const std::string high = std::to_string(rows * height);
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + wide + " " +
                     high + "\" width=\"" + wide + "\" height=\"" + high + "\">\n" + styles() +
                     "<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n";
  const bool small = columns > 1;
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const int number = static_cast<int>(i);
    const std::span<const Chart> scaledBy =
        small ? std::span<const Chart>(charts) : std::span<const Chart>(&charts[i], 1);
    text += "<g transform=\"translate(" + std::to_string(number % columns * width) + " " +
            std::to_string(number / columns * height) + ")\">\n" +
            Drawing(charts[i], scaledBy, width, height, small).text() + "</g>\n";
  }
  return text + "</svg>\n";
}

std::string toSvg(const Chart& chart, int width, int height) {
  return toSvg(std::vector<Chart>{chart}, width, height);
}

}  // namespace catoptric::study
