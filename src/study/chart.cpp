#include "study/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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
constexpr double kTop = 58.0;  // title and legend
constexpr double kBottom = 50.0;
constexpr double kLetter = 6.1;  // mean width of a letter of 11 pixels

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
  Scale(double least, double most, bool log, bool fromZero, double pixelLow, double pixelHigh)
      : log_(log && least > 0.0), pixelLow_(pixelLow), pixelHigh_(pixelHigh) {
    if (!(least <= most)) least = 0.0, most = 1.0;
    if (log_) {
      low_ = std::log10(least);
      high_ = std::log10(most);
      const double margin = std::max(0.04, 0.06 * (high_ - low_));
      low_ -= margin;
      high_ += margin;
    } else {
      low_ = fromZero ? std::min(0.0, least) : least;
      high_ = most;
      if (high_ <= low_) high_ = low_ + 1.0;
      high_ += 0.06 * (high_ - low_);
      if (!fromZero) low_ -= 0.06 * (high_ - low_);
    }
    makeTicks();
  }

  double at(double value) const {
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
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  void add(double value) {
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
         "stroke-width:1}.grid{stroke-width:1}" +
         scheme(kLight, "#1c1c1c", "#666", "#e6e6e6", "#fff") +
         "@media(prefers-color-scheme:dark){" +
         scheme(kDark, "#e8e8e8", "#a8a8a8", "#333", "#16181b") + "}</style>\n";
}

/// Draws one chart with its upper left corner at (0, top).
class Drawing {
 public:
  Drawing(const Chart& chart, double top, double width, double height)
      : chart_(chart),
        top_(top),
        width_(width),
        height_(height),
        x_(makeScale(chart, true, kLeft, width - kRight)),
        y_(makeScale(chart, false, top + height - kBottom, top + kTop)) {}

  std::string text() {
    frame();
    legend();
    if (chart_.showFront) front();
    for (std::size_t s = 0; s < chart_.series.size(); ++s) series(s);
    labels();
    return out_;
  }

 private:
  static Scale makeScale(const Chart& chart, bool ofX, double low, double high) {
    Range range;
    for (const ChartSeries& series : chart.series)
      for (const ChartPoint& point : series.points) {
        range.add(ofX ? point.x : point.y);
        if (ofX && point.xInterval) {
          range.add(point.xInterval->low);
          range.add(point.xInterval->high);
        }
        if (!ofX && point.yWorst) range.add(*point.yWorst);
      }
    return {range.least, range.most, ofX ? chart.xLog : chart.yLog, chart.fromZero, low, high};
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
    const double bottom = top_ + height_ - kBottom;
    put(kLeft - 46.0, top_ + 22.0, chart_.title, "ink title");
    for (const double tick : y_.ticks()) {
      line(kLeft, y_.at(tick), width_ - kRight, y_.at(tick), "grid");
      put(kLeft - 7.0, y_.at(tick) + 4.0, tickText(tick), "soft", "end");
    }
    for (const double tick : x_.ticks()) {
      line(x_.at(tick), top_ + kTop, x_.at(tick), bottom, "grid");
      put(x_.at(tick), bottom + 16.0, tickText(tick), "soft", "middle");
    }
    line(kLeft, bottom, width_ - kRight, bottom, "axis");
    put(0.5 * (kLeft + width_ - kRight), bottom + 36.0, chart_.xTitle, "ink", "middle");
    const double middle = 0.5 * (top_ + kTop + bottom);
    out_ += "<text transform=\"translate(15 " + px(middle) + ") rotate(-90)\" class=\"ink\" " +
            "text-anchor=\"middle\">" + report::xmlText(chart_.yTitle) + "</text>\n";
  }

  void legend() {
    double x = kLeft;
    for (std::size_t s = 0; s < chart_.series.size(); ++s) {
      out_ += "<circle cx=\"" + px(x + 4.0) + "\" cy=\"" + px(top_ + 40.0) +
              "\" r=\"4\" class=\"f" + std::to_string(s % kLight.size()) + "\"/>\n";
      put(x + 13.0, top_ + 44.0, chart_.series[s].name, "ink");
      x += 30.0 + kLetter * static_cast<double>(chart_.series[s].name.size());
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
    double least = std::numeric_limits<double>::infinity();
    for (const ChartPoint* point : points) {
      if (point->y >= least) continue;
      path += (path.empty() ? "M" : "H") + px(x_.at(point->x)) + (path.empty() ? " " : "V") +
              px(y_.at(point->y));
      least = point->y;
    }
    if (!path.empty())
      out_ += "<path d=\"" + path + "\" class=\"thin front\" stroke-dasharray=\"4 3\"/>\n";
  }

  void series(std::size_t s) {
    const ChartSeries& series = chart_.series[s];
    const std::string colour = std::to_string(s % kLight.size());
    if (series.joined) {
      std::string path;
      for (const ChartPoint& point : series.points)
        path += (path.empty() ? "M" : "L") + px(x_.at(point.x)) + " " + px(y_.at(point.y));
      out_ += "<path d=\"" + path + "\" class=\"line s" + colour + "\"/>\n";
    }
    for (const ChartPoint& point : series.points) {
      const double x = x_.at(point.x);
      const double y = y_.at(point.y);
      out_ += "<g>";
      if (!point.title.empty()) out_ += "<title>" + report::xmlText(point.title) + "</title>";
      if (point.yWorst) line(x, y, x, y_.at(*point.yWorst), "thin s" + colour);
      if (point.xInterval)
        line(x_.at(point.xInterval->low), y, x_.at(point.xInterval->high), y, "line s" + colour);
      const std::string look = point.mark == Mark::Front ? "f" + colour
                               : point.mark == Mark::Unclear
                                   ? "hole s" + colour + "\" stroke-dasharray=\"2 1.5"
                                   : "hole s" + colour;
      out_ += "<circle cx=\"" + px(x) + "\" cy=\"" + px(y) + "\" r=\"4.2\" class=\"" + look +
              "\"/></g>\n";
      taken_.push_back({x - 5.0, y - 5.0, x + 5.0, y + 5.0});
    }
  }

  /// Beside the points, on the side where nothing stands; else not at all.
  void labels() {
    for (const ChartSeries& series : chart_.series)
      for (const ChartPoint& point : series.points) {
        if (point.label.empty()) continue;
        const double wide = kLetter * static_cast<double>(point.label.size());
        const double x = x_.at(point.x);
        const double y = y_.at(point.y);
        struct Side {
          double x, y;
          const char* anchor;
        };
        for (const Side& side : {Side{x + 8.0, y - 6.0, "start"}, Side{x + 8.0, y + 13.0, "start"},
                                 Side{x - 8.0, y - 6.0, "end"}, Side{x - 8.0, y + 13.0, "end"}}) {
          const double from = side.anchor[0] == 's' ? side.x : side.x - wide;
          const Box box{from, side.y - 9.0, from + wide, side.y + 2.0};
          if (box.x0 < kLeft || box.x1 > width_ || box.y1 > top_ + height_ - kBottom ||
              box.y0 < top_ + kTop - 10.0)
            continue;
          if (std::any_of(taken_.begin(), taken_.end(),
                          [&](const Box& other) { return box.meets(other); }))
            continue;
          put(side.x, side.y, point.label, "soft", side.anchor);
          taken_.push_back(box);
          break;
        }
      }
  }

  const Chart& chart_;
  double top_;
  double width_;
  double height_;
  Scale x_;
  Scale y_;
  std::vector<Box> taken_;
  std::string out_;
};

}  // namespace

std::string toSvg(const std::vector<Chart>& charts, int width, int height) {
  const int all = height * static_cast<int>(charts.size());
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " +
                     std::to_string(width) + " " + std::to_string(all) + "\" width=\"" +
                     std::to_string(width) + "\" height=\"" + std::to_string(all) + "\">\n" +
                     styles() + "<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n";
  for (std::size_t i = 0; i < charts.size(); ++i)
    text += Drawing(charts[i], static_cast<double>(height) * static_cast<double>(i), width, height)
                .text();
  return text + "</svg>\n";
}

std::string toSvg(const Chart& chart, int width, int height) {
  return toSvg(std::vector<Chart>{chart}, width, height);
}

}  // namespace catoptric::study
