#include "report/error_tables.h"

#include <algorithm>
#include <cmath>

#include "config/json_text.h"
#include "core/text.h"
#include "report/motion_tables.h"

namespace catoptric::report {
namespace {

using measure::ErrorClass;
using measure::ErrorShare;
using measure::FlipPool;
using measure::ImageError;
using measure::RegionError;

std::string decibels(const RegionError& e) {
  return e.isBlack() ? "black" : std::isinf(e.psnr()) ? "inf" : fixedText(e.psnr(), 2);
}

std::string place(const RegionError& e) {
  return e.max8X < 0 ? "" : std::to_string(e.max8X) + "," + std::to_string(e.max8Y);
}

double percent(double part, double whole) {
  return whole > 0.0 ? 100.0 * part / whole : 0.0;
}

/// Which columns the tables have: those of layers that no frame has are left out.
struct LayerColumns {
  bool standardError = false;
  bool reflective = false;
  bool oneBounce = false;

  explicit LayerColumns(std::span<const RunComparison> comparisons) {
    for (const RunComparison& c : comparisons) {
      standardError = standardError || c.pooled.hasStandardError;
      reflective = reflective || c.pooled.hasReflective;
      oneBounce = oneBounce || c.pooled.hasOneBounce;
    }
  }
};

/// Columns of the tables, after their first ones: the names of the CSV files, of JSON and of
/// bounds.
void appendMeasureColumns(std::vector<Column>& columns, const LayerColumns& layers) {
  const auto add = [&](bool detail, std::initializer_list<const char*> names) {
    for (const char* name : names) columns.push_back({name, true, detail});
  };
  add(false, {"L1_8bit"});
  if (layers.standardError) add(true, {"standard_error"});
  if (layers.reflective) add(true, {"L1_8bit_reflective", "L1_8bit_elsewhere"});
  if (layers.oneBounce) add(true, {"L1_8bit_one_bounce", "L1_8bit_bounces"});
  add(false, {"max_8bit"});
  add(true, {"mae", "rmse", "relmse", "psnr", "ssim"});
  add(false, {"flip_mean"});
  add(true, {"hdr_flip_mean", "over_percent"});
}

/// Measures of a row of the tables, after its first cells.
void appendMeasures(std::vector<std::string>& cells, const ImageError& e,
                    const LayerColumns& layers) {
  const auto add = [&](bool known, double value, int decimals) {
    cells.push_back(known ? fixedText(value, decimals) : "");
  };
  add(true, e.l1(), 3);
  if (layers.standardError) add(e.hasStandardError, e.standardError(), 3);
  if (layers.reflective) {
    add(e.hasReflective, e.l1Reflective(), 3);
    add(e.hasReflective, e.elsewhere.l1(), 3);
  }
  if (layers.oneBounce) {
    add(e.hasOneBounce, e.l1OneBounce(), 3);
    add(e.hasOneBounce, e.l1Bounces(), 3);
  }
  cells.push_back(std::to_string(e.max8));
  add(true, e.mae(), 5);
  add(true, e.rmse(), 5);
  add(true, e.relMse(), 5);
  cells.push_back(decibels(e));
  add(true, e.ssim(), 4);
  add(true, e.flip(), 4);
  add(true, e.hdrFlip(), 4);
  add(true, e.overPercent(), 2);
}

/// What the columns mean.
void appendMeaning(Table& table, const LayerColumns& layers) {
  table.notes.emplace_back(
      "L1_8bit, max_8bit: display steps, 0..255; mae, rmse, relmse, psnr (dB, peak 1), ssim "
      "(luminance): scene-linear; over_percent: pixels beyond the threshold; flip_mean, "
      "hdr_flip_mean: 0..1.");
  if (layers.reflective)
    table.notes.emplace_back(
        "_reflective: over reflective pixels; _elsewhere: over the others, which no method of "
        "reflections changes (antialiasing, refraction).");
  if (layers.standardError)
    table.notes.emplace_back(
        "standard_error: the reference's own expected L1_8bit. Lower errors cannot be told apart.");
  if (layers.oneBounce)
    table.notes.emplace_back(
        "L1_8bit_bounces: what bounces after the first change in the reference. "
        "L1_8bit_one_bounce: against the reference's picture with one bounce.");
}

/// Names what is at least as exact as its reference: its error says no more.
void appendWithin(Table& table, const RunComparison& c) {
  if (!c.pooled.withinUncertainty()) return;
  table.notes.push_back(
      c.name + " is within the uncertainty of " + c.reference + ": its L1_8bit " +
      fixedText(c.pooled.l1(), 3) + " is not above the standard error " +
      fixedText(c.pooled.standardError(), 3) +
      ". It may be the more exact of the two; a smaller max_standard_error would tell.");
}

/// NaN and infinities first: nothing else can be trusted beside them.
void appendNotFinite(Table& table, const std::string& name, const ImageError& e) {
  if (e.notFinite + e.notFiniteReference == 0) return;
  table.notes.push_back("ATTENTION: " + name + ": NaN or infinity in " +
                        std::to_string(e.notFinite) + " pixels, and in " +
                        std::to_string(e.notFiniteReference) +
                        " of the reference; they count as a difference of 255 in 8-bit measures, "
                        "and are left out of linear ones.");
}

std::string frameList(const std::vector<int>& frames) {
  std::string text;
  for (const int frame : frames) text += (text.empty() ? "" : ",") + std::to_string(frame);
  return text;
}

/// Two black frames agree, and that says nothing.
void appendBlack(Table& table, const std::string& name, const RunComparison& c) {
  std::vector<int> black;
  for (const auto& [number, e] : c.frames)
    if (e.isBlack()) black.push_back(number);
  if (black.empty()) return;
  table.notes.push_back("ATTENTION: " + name + ": both sides are completely black in " +
                        (black.size() == 1 ? "frame " : "frames ") + frameList(black) +
                        "; errors of 0 say nothing there.");
}

/// Why columns are empty.
void appendNoReflective(Table& table, std::span<const RunComparison> comparisons) {
  std::vector<std::string> names;
  for (const RunComparison& c : comparisons)
    if (!c.pooled.hasReflective && std::ranges::find(names, c.name) == names.end())
      names.push_back(c.name);
  if (names.empty()) return;
  table.notes.push_back("No L1_8bit_reflective of " + joined(names, ", ") +
                        ": no frame has a layer that marks reflective pixels. Render with "
                        "image.masks=true, or with \"s\" in image.layers.");
}

void appendMissing(Table& table, const RunComparison& c) {
  if (!c.onlyInRun.empty())
    table.notes.push_back(c.reference + " lacks frames " + frameList(c.onlyInRun) + " of " +
                          c.name + ".");
  if (!c.onlyInReference.empty())
    table.notes.push_back(c.name + " lacks frames " + frameList(c.onlyInReference) + " of " +
                          c.reference + ".");
}

/// Members of a region, NaN first; `pooled` tells the frame of the largest error too.
void addMembers(config::JsonText& text, const RegionError& e, bool pooled) {
  text.add("not_finite", e.notFinite).add("not_finite_reference", e.notFiniteReference);
  text.add("both_black", e.bothBlack);
  text.add("pixels", e.pixels).add("L1_8bit", e.l1()).add("mae", e.mae()).add("rmse", e.rmse());
  text.add("relmse", e.relMse());
  if (std::isinf(e.psnr()))
    text.raw("psnr", "null");
  else
    text.add("psnr", e.psnr());
  text.add("ssim", e.ssim()).add("flip_mean", e.flip()).add("flip_max", double{e.flipMax});
  text.add("hdr_flip_mean", e.hdrFlip()).add("hdr_flip_max", double{e.hdrFlipMax});
  text.add("over_percent", e.overPercent());
  text.add("max_8bit", e.max8);
  if (e.max8X >= 0) text.add("max_8bit_pixel", std::vector<int>{e.max8X, e.max8Y});
  if (pooled && e.max8X >= 0) text.add("max_8bit_frame", e.max8Frame);
  text.add("max_linear", e.maxLinear);
  if (e.maxLinearX >= 0) text.add("max_linear_pixel", std::vector<int>{e.maxLinearX, e.maxLinearY});
  if (pooled && e.maxLinearX >= 0) text.add("max_linear_frame", e.maxLinearFrame);
}

void addPool(config::JsonText& text, const std::string& prefix, const FlipPool& pool) {
  text.add(prefix + "_weighted_median", pool.weightedQuantile(0.5));
  text.add(prefix + "_1st_weighted_quartile", pool.weightedQuantile(0.25));
  text.add(prefix + "_3rd_weighted_quartile", pool.weightedQuantile(0.75));
  text.add(prefix + "_min", pool.min());
}

/// Shares of a class, in percent of the frame's.
struct Percents {
  double pixels = 0.0;
  double l1 = 0.0;
  double squared = 0.0;
  double flip = 0.0;

  Percents(const ErrorShare& share, const ImageError& whole)
      : pixels(percent(static_cast<double>(share.pixels), static_cast<double>(whole.pixels))),
        l1(percent(static_cast<double>(share.sum8), static_cast<double>(whole.sum8))),
        squared(percent(share.sumSquared, whole.sumSquared)),
        flip(percent(share.hdrFlipSum, whole.hdrFlipSum)) {}
};
double l1Inside(const ErrorShare& share) {
  return measure::quotient(static_cast<double>(share.sum8),
                           3.0 * static_cast<double>(share.pixels));
}

std::string json(const ImageError& e, const std::string& frameMember) {
  const bool pooled = frameMember.empty();
  config::JsonText text;
  if (!pooled) text.raw("frame", frameMember);
  addMembers(text, e, pooled);
  addPool(text, "flip", e.flipPool);
  addPool(text, "hdr_flip", e.hdrFlipPool);
  if (e.hasStandardError) text.add("standard_error", e.standardError());
  if (e.hasOneBounce)
    text.add("L1_8bit_one_bounce", e.l1OneBounce()).add("L1_8bit_bounces", e.l1Bounces());
  if (e.hasReflective) {
    text.add("reflective_pixels", e.reflective.pixels)
        .add("L1_8bit_reflective", e.l1Reflective())
        .add("L1_8bit_elsewhere", e.elsewhere.l1());
    config::JsonText part;
    addMembers(part, e.reflective, pooled);
    text.raw("reflective", part.object());
  }
  std::string objects;
  for (const auto& [id, object] : e.objects) {
    config::JsonText part;
    part.add("id", id);
    addMembers(part, object, pooled);
    objects += (objects.empty() ? "" : ",") + part.object();
  }
  text.raw("objects", "[" + objects + "]");
  std::string classes;
  for (const ErrorClass& one : e.classes) {
    const Percents all(one.all, e);
    const Percents own(one.own, e);
    classes += (classes.empty() ? "" : ",") + config::JsonText()
                                                  .add("class", one.name)
                                                  .add("pixels", one.all.pixels)
                                                  .add("L1_8bit", l1Inside(one.all))
                                                  .add("pixels_percent", all.pixels)
                                                  .add("L1_percent", all.l1)
                                                  .add("squared_percent", all.squared)
                                                  .add("hdr_flip_percent", all.flip)
                                                  .add("own_pixels_percent", own.pixels)
                                                  .add("own_L1_percent", own.l1)
                                                  .add("own_squared_percent", own.squared)
                                                  .add("own_hdr_flip_percent", own.flip)
                                                  .object();
  }
  text.raw("attribution", "[" + classes + "]");
  return text.object();
}

std::string pixelText(int x, int y) {
  return x >= 0 ? std::to_string(x) + "," + std::to_string(y) : ",";
}

std::string csvMeasures(const RegionError& e) {
  return std::to_string(e.notFinite) + "," + std::to_string(e.notFiniteReference) + "," +
         std::to_string(e.pixels) + "," + exactText(e.l1()) + "," + exactText(e.mae()) + "," +
         exactText(e.rmse()) + "," + exactText(e.relMse()) + "," + exactText(e.psnr()) + "," +
         exactText(e.ssim()) + "," + exactText(e.overPercent()) + "," + std::to_string(e.max8) +
         "," + pixelText(e.max8X, e.max8Y) + "," + exactText(e.maxLinear) + "," +
         pixelText(e.maxLinearX, e.maxLinearY);
}
/// FLIP's own columns: mean, weighted median and quartiles, min, max; without a pool some are
/// empty.
std::string csvFlip(double mean, double max, const FlipPool* pool) {
  const auto quantile = [&](double share) {
    return pool != nullptr ? exactText(pool->weightedQuantile(share)) : std::string();
  };
  return exactText(mean) + "," + quantile(0.5) + "," + quantile(0.25) + "," + quantile(0.75) + "," +
         (pool != nullptr ? exactText(pool->min()) : "") + "," + exactText(max);
}

}  // namespace

Table errorView(const RunComparison& comparison) {
  Table table;
  table.title = comparison.name + " against " + comparison.reference;
  const LayerColumns layers(std::span(&comparison, 1));
  table.columns = {{"frame", true}};
  appendMeasureColumns(table.columns, layers);
  table.columns.push_back({"max_8bit at x,y", true});
  for (const auto& [number, e] : comparison.frames) {
    std::vector<std::string> cells{std::to_string(number)};
    appendMeasures(cells, e, layers);
    cells.push_back(place(e));
    table.rows.push_back(cells);
  }
  table.rows.emplace_back();
  std::vector<std::string> cells{"all"};
  appendMeasures(cells, comparison.pooled, layers);
  const std::string worst = place(comparison.pooled);
  cells.push_back(
      worst.empty() ? "" : worst + " in frame " + std::to_string(comparison.pooled.max8Frame));
  table.rows.push_back(cells);
  appendNotFinite(table, comparison.name, comparison.pooled);
  appendBlack(table, comparison.name, comparison);
  appendNoReflective(table, std::span(&comparison, 1));
  appendMissing(table, comparison);
  appendWithin(table, comparison);
  appendMeaning(table, layers);
  return table;
}

Table objectView(const RunComparison& comparison) {
  Table table;
  table.title = "Reflective objects, all frames";
  table.columns = {{"id", true, true},   {"name", false},
                   {"pixels", true},     {"L1_8bit", true},
                   {"rmse", true, true}, {"ssim", true, true},
                   {"flip_mean", true},  {"hdr_flip_mean", true, true},
                   {"max_8bit", true},   {"at x,y", true, true}};
  for (const auto& [id, e] : comparison.pooled.objects) {
    const auto name = comparison.objectNames.find(id);
    table.rows.push_back(
        {std::to_string(id), name == comparison.objectNames.end() ? "" : name->second,
         std::to_string(e.pixels), fixedText(e.l1(), 3), fixedText(e.rmse(), 5),
         fixedText(e.ssim(), 4), fixedText(e.flip(), 4), fixedText(e.hdrFlip(), 4),
         std::to_string(e.max8),
         e.max8X < 0 ? "" : place(e) + " in frame " + std::to_string(e.max8Frame)});
  }
  return table;
}

Table attributionView(const RunComparison& comparison) {
  const ImageError& e = comparison.pooled;
  Table table;
  table.title = "Where the error is, all frames";
  table.columns = {{"class", false},
                   {"pixels %", true},
                   {"L1_8bit", true},
                   {"L1 %", true},
                   {"squared %", true, true},
                   {"hdr_flip %", true, true},
                   {"own pixels %", true, true},
                   {"own L1 %", true},
                   {"own squared %", true, true}};
  for (const ErrorClass& one : e.classes) {
    const Percents all(one.all, e);
    const Percents own(one.own, e);
    table.rows.push_back({one.name, fixedText(all.pixels, 2), fixedText(l1Inside(one.all), 3),
                          fixedText(all.l1, 2), fixedText(all.squared, 2), fixedText(all.flip, 2),
                          fixedText(own.pixels, 2), fixedText(own.l1, 2),
                          fixedText(own.squared, 2)});
  }
  table.notes = {"Classes overlap; \"own\" counts a pixel in its first class only, and adds up."};
  return table;
}

Table errorSummary(std::span<const RunComparison> comparisons,
                   std::span<const TimingTable> timings) {
  Table table;
  const LayerColumns layers(comparisons);
  table.columns = {{"method", false}, {"against", false}, {"frames", true}};
  appendMeasureColumns(table.columns, layers);
  const bool cold =
      std::ranges::all_of(timings, [](const TimingTable& t) { return t.frames == 1; });
  if (!timings.empty()) table.columns.push_back({cold ? "first frame ms" : "median ms", true});
  const auto medianOf = [&](const std::string& name) {
    for (const TimingTable& timing : timings)
      if (timing.name == name) return timing.rendering.median;
    return 0.0;
  };
  for (const RunComparison& c : comparisons) {
    std::vector<std::string> cells{c.name, c.reference, std::to_string(c.frames.size())};
    appendMeasures(cells, c.pooled, layers);
    if (!timings.empty()) {
      const double time = medianOf(c.name);
      cells.push_back(time > 0.0 ? fixedText(time * 1e3, 2) : "");
    }
    table.rows.push_back(cells);
    appendNotFinite(table, c.name + " against " + c.reference, c.pooled);
    appendBlack(table, c.name + " against " + c.reference, c);
    appendMissing(table, c);
    appendWithin(table, c);
  }
  appendNoReflective(table, comparisons);
  appendMeaning(table, layers);
  return table;
}

std::string errorCsv(std::span<const RunComparison> comparisons) {
  const auto flipColumns = [](const std::string& p) {
    return "," + p + "_mean," + p + "_weighted_median," + p + "_1st_weighted_quartile," + p +
           "_3rd_weighted_quartile," + p + "_min," + p + "_max";
  };
  std::string text =
      "method,against,frame,region,not_finite,not_finite_reference,pixels,L1_8bit,mae,rmse,relmse,"
      "psnr,ssim,over_percent,max_8bit,max_8bit_x,max_8bit_y,max_linear,max_linear_x,max_linear_y" +
      flipColumns("flip") + flipColumns("hdr_flip") +
      ",both_black,standard_error,L1_8bit_one_bounce,L1_8bit_bounces\n";
  for (const RunComparison& c : comparisons) {
    const auto ofTruth = [](bool known, double value) {
      return "," + (known ? exactText(value) : std::string());
    };
    const auto row = [&](const std::string& frame, const std::string& region, const RegionError& e,
                         const FlipPool* pool, const FlipPool* hdrPool) {
      text += csvCell(c.name) + "," + csvCell(c.reference) + "," + frame + "," + region + "," +
              csvMeasures(e) + "," + csvFlip(e.flip(), e.flipMax, pool) + "," +
              csvFlip(e.hdrFlip(), e.hdrFlipMax, hdrPool) + "," + std::to_string(e.bothBlack) +
              ofTruth(c.pooled.hasStandardError, e.standardError()) +
              ofTruth(c.pooled.hasOneBounce, e.l1OneBounce()) +
              ofTruth(c.pooled.hasOneBounce, e.l1Bounces()) + "\n";
    };
    const auto rows = [&](const std::string& frame, const ImageError& e) {
      row(frame, "frame", e, &e.flipPool, &e.hdrFlipPool);
      if (e.hasReflective) {
        row(frame, "reflective", e.reflective, nullptr, nullptr);
        row(frame, "elsewhere", e.elsewhere, nullptr, nullptr);
      }
      for (const auto& [id, object] : e.objects)
        row(frame, "object:" + std::to_string(id), object, nullptr, nullptr);
    };
    for (const auto& [number, e] : c.frames) rows(std::to_string(number), e);
    rows("all", c.pooled);
  }
  return text;
}

std::string attributionCsv(std::span<const RunComparison> comparisons) {
  std::string text =
      "method,against,frame,class,pixels,L1_8bit,pixels_percent,L1_percent,squared_percent,"
      "hdr_flip_percent,own_pixels_percent,own_L1_percent,own_squared_percent,"
      "own_hdr_flip_percent\n";
  for (const RunComparison& c : comparisons) {
    const auto rows = [&](const std::string& frame, const ImageError& e) {
      for (const ErrorClass& one : e.classes) {
        text += csvCell(c.name) + "," + csvCell(c.reference) + "," + frame + "," +
                csvCell(one.name) + "," + std::to_string(one.all.pixels) + "," +
                exactText(l1Inside(one.all));
        for (const ErrorShare* share : {&one.all, &one.own}) {
          const Percents p(*share, e);
          for (const double v : {p.pixels, p.l1, p.squared, p.flip}) text += "," + exactText(v);
        }
        text += "\n";
      }
    };
    for (const auto& [number, e] : c.frames) rows(std::to_string(number), e);
    rows("all", c.pooled);
  }
  return text;
}

std::string errorJson(std::span<const RunComparison> comparisons) {
  std::string text = "[";
  for (const RunComparison& c : comparisons) {
    std::string frames;
    for (const auto& [number, e] : c.frames)
      frames += (frames.empty() ? "" : ",") + json(e, std::to_string(number));
    text += (text.size() > 1 ? "," : "") + config::JsonText()
                                               .add("method", c.name)
                                               .add("against", c.reference)
                                               .raw("pooled", json(c.pooled, ""))
                                               .raw("frames", "[" + frames + "]")
                                               .raw("motion", motionJson(c.motion))
                                               .add("only_in_run", c.onlyInRun)
                                               .add("only_in_reference", c.onlyInReference)
                                               .object();
  }
  return text + "]";
}

}  // namespace catoptric::report
