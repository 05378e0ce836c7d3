#include "nightly/page.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "core/error.h"
#include "core/file.h"
#include "core/remove_files.h"
#include "core/text.h"
#include "nightly/accept.h"
#include "nightly/judge_night.h"
#include "nightly/junit.h"
#include "nightly/page_assets.h"
#include "nightly/page_pictures.h"
#include "nightly/summary.h"
#include "report/html.h"
#include "study/chart.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;

/// Frames of a case whose pictures are shown; the others are named. Ours.
constexpr int kShownFrames = 3;
/// What text may take of a single file: the rest is for pictures.
constexpr std::size_t kTextRoom = 4'000'000;

/// Every page of ours has it.
constexpr const char* kMark = "<main id=\"failures\">";

std::string text(const std::string& raw) {
  return xmlSafe(raw);
}

const char* outcomeName(Outcome outcome) {
  switch (outcome) {
    case Outcome::Crash:
      return "crash";
    case Outcome::Regression:
      return "regression";
    case Outcome::Skipped:
      return "skipped";
    default:
      return "good";
  }
}

std::string lower(std::string words) {
  for (char& c : words) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return words;
}

/// Verdicts of one case.
struct CaseVerdicts {
  std::string name;
  Outcome outcome = Outcome::Good;
  std::vector<Verdict> verdicts;

  bool hasChangedScene() const {
    return std::ranges::any_of(
        verdicts, [](const Verdict& verdict) { return verdict.status == kChangedScene; });
  }

  std::string words() const {
    std::string all = name;
    for (const Verdict& verdict : verdicts)
      if (verdict.outcome != Outcome::Good) all += " " + verdict.kind + " " + verdict.status;
    return lower(all);
  }
};

std::vector<CaseVerdicts> byCase(const std::vector<Verdict>& verdicts) {
  std::map<std::string, CaseVerdicts> cases;
  for (const Verdict& verdict : verdicts) {
    CaseVerdicts& one = cases[verdict.name];
    one.name = verdict.name;
    one.outcome = std::max(one.outcome, outcomeOf(verdict));
    one.verdicts.push_back(verdict);
  }
  std::vector<CaseVerdicts> all;
  for (auto& [name, one] : cases) all.push_back(std::move(one));
  std::stable_sort(all.begin(), all.end(), [](const CaseVerdicts& a, const CaseVerdicts& b) {
    return a.outcome > b.outcome;
  });
  return all;
}

/// A table with a summary that opens it; nothing where it has no rows.
std::string folded(const char* summary, const report::Table& table, bool open) {
  if (table.rows.empty()) return "";
  return std::string("<details") + (open ? " open" : "") + "><summary>" + summary + "</summary>" +
         report::htmlTable(table, text) + "</details>\n";
}

std::string copyLine(const std::string& line) {
  return "<div class=\"copy\"><code>" + text(line) + "</code></div>\n";
}

class PageWriter {
 public:
  PageWriter(const History& history, const Night& night, const std::vector<Verdict>& verdicts,
             const PageOptions& options)
      : history_(history),
        night_(night),
        options_(options),
        cases_(byCase(verdicts)),
        summary_(summaryOf(verdicts)),
        pictures_(history, options.out, options.singleFile, kSingleFileBytes - kTextRoom) {}

  std::string page() {
    std::string changed;
    for (const CaseVerdicts& one : cases_)
      if (one.outcome != Outcome::Good)
        (one.hasChangedScene() ? changed : articles_) += article(one);
    if (!changed.empty())
      changed =
          "<h2>Changed scenes</h2>\n<p>Their files are not those whose frames were accepted. "
          "Until they are accepted, tonight’s build is not compared with another one there.</p>\n" +
          changed;
    std::string body =
        head() + filter() + kMark + "\n" + changed + "<h2>Problems</h2>\n" +
        (articles_.empty() ? "<p>None: every " + std::string(changed.empty() ? "" : "other ") +
                                 "case is as it was accepted.</p>\n"
                           : articles_) +
        "</main>\n" + table() + acknowledgements() + notes();
    const std::string style = options_.singleFile
                                  ? "<style>" + std::string(kPageStyle) + "</style>\n"
                                  : std::string("<link rel=\"stylesheet\" href=\"nightly.css\">\n");
    const std::string script = options_.singleFile
                                   ? "<script>" + std::string(kPageScript) + "</script>\n"
                                   : std::string("<script src=\"nightly.js\"></script>\n");
    return report::htmlPage(options_.title + ", night " + std::to_string(night_.id), style,
                            body + script);
  }

  const std::map<std::string, std::string>& curves() const { return curves_; }

 private:
  std::string head() const {
    const Outcome worst = cases_.empty() ? Outcome::Good : cases_.front().outcome;
    return "<a class=\"skip\" href=\"#failures\">To what is not good</a>\n<h1>" +
           text(options_.title) + "</h1>\n<p>Night " + std::to_string(night_.id) + ", " +
           text(night_.started) + ", effort " + text(night_.effort) + ", build <code>" +
           text(night_.build) + "</code> (" + text(night_.version) + ") on " +
           text(night_.machine) + "</p>\n<p class=\"end " + outcomeName(worst) + "\">" +
           text(summary_.text()) + ".</p>\n";
  }

  static std::string filter() {
    std::string boxes;
    for (const auto& [value, label] :
         {std::pair{"crash", "crashes"}, std::pair{"regression", "regressions"},
          std::pair{"skipped", "others"}, std::pair{"good", "good"}})
      boxes += "<label><input type=\"checkbox\" name=\"outcome\" value=\"" + std::string(value) +
               "\" checked> " + label + "</label>\n";
    return "<form class=\"filter\" hidden role=\"search\"><label>Filter <input type=\"search\" "
           "name=\"words\" placeholder=\"scene, method, picture, slower\"></label>\n" +
           boxes + "<output aria-live=\"polite\"></output></form>\n";
  }

  std::string attributes(const CaseVerdicts& one) const {
    return "data-outcome=\"" + std::string(outcomeName(one.outcome)) + "\" data-words=\"" +
           text(one.words()) + "\"";
  }

  std::string article(const CaseVerdicts& one) {
    std::string lines;
    std::vector<Verdict> frames;
    bool wants = false;
    bool timed = false;
    for (const Verdict& verdict : one.verdicts) {
      if (verdict.outcome == Outcome::Good) continue;
      lines += verdictLine(verdict);
      if (verdict.kind == "picture" && verdict.frame != 0) frames.push_back(verdict);
      timed = timed || verdict.kind == "time" || verdict.kind == "creep";
      wants = wants || wantsAcceptance(verdict);
    }
    std::string commands;
    CaseFacts facts;
    if (history_.bench(night_.id, one.name)) {
      facts = history_.result(night_.id, one.name);
      if (!facts.command.empty()) commands += copyLine(facts.command + " --out out/again");
      if (wants)
        commands += copyLine("catoptric nightly accept " + one.name + " --history " +
                             shellWord(options_.historyOption) + " --reason 'WHY'");
    }
    return "<article id=\"" + text(one.name) + "\" " + attributes(one) + ">\n<h3><a href=\"#" +
           text(one.name) + "\">" + text(one.name) + "</a> <span class=\"" +
           outcomeName(one.outcome) + "\">" + outcomeName(one.outcome) + "</span></h3>\n<ul>" +
           lines + "</ul>\n" + commands + (timed ? trend(one.name, facts.bench) : "") +
           (timed ? steps(facts) : "") + figures(facts, frames, one.hasChangedScene()) +
           "</article>\n";
  }

  std::string verdictLine(const Verdict& verdict) const {
    std::string line = "<li><strong class=\"" + std::string(outcomeName(outcomeOf(verdict))) +
                       "\">" + text(verdict.kind) + ": " + text(verdict.status) + "</strong>";
    if (verdict.frame != 0) line += ", frame " + std::to_string(verdict.frame);
    line += ": " + text(verdict.message);
    if (verdict.acknowledgement != 0)
      line += " <span class=\"skipped\">acknowledged, number " +
              std::to_string(verdict.acknowledgement) + "</span>";
    if (verdict.outcome == Outcome::Regression || verdict.outcome == Outcome::Crash)
      line += " <span class=\"soft\">since night " + std::to_string(verdict.began) +
              (verdict.lastGood.empty() ? "" : "; last good build " + text(verdict.lastGood)) +
              (verdict.firstBad.empty() ? "" : ", first bad build " + text(verdict.firstBad)) +
              "</span>";
    return line + "</li>\n";
  }

  /// A curve of the ratios to the anchor build over the nights.
  std::string trend(const std::string& name, const std::string& bench) {
    std::vector<TrendPoint> points = trendOf(
        history_, {night_.id + 1, night_.suite, "", "", night_.machine, "", "", "", "", false},
        name, bench);
    if (points.size() < 2) return "";
    if (points.size() > 60) points.erase(points.begin(), points.end() - 60);
    study::Chart chart;
    chart.title = "Time against the anchor build";
    chart.xTitle = "night";
    chart.yTitle = "times as long";
    study::ChartSeries series{"nights up to this one", {}, true};
    for (const TrendPoint& point : points) {
      study::ChartPoint at;
      at.x = point.night;
      at.y = point.value;
      at.title = "night " + std::to_string(point.night) + ": " + report::fixedText(point.value, 3);
      series.points.push_back(at);
    }
    chart.series.push_back(std::move(series));
    const std::vector<Level> levels = levelsOf(points);
    std::string words;
    if (levels.size() > 1) {
      study::ChartSeries steps{"levels", {}, true};
      for (const Level& level : levels) {
        const int first = points[level.first].night;
        const int last = points[level.first + level.count - 1].night;
        for (const int night : {first, last}) {
          study::ChartPoint at;
          at.x = night;
          at.y = level.value;
          at.mark = study::Mark::Dominated;
          steps.points.push_back(at);
        }
        words +=
            (words.empty() ? "Levels: " : "; ") + report::fixedText(level.value, 3) +
            (first == last ? " in night " + std::to_string(first)
                           : " in nights " + std::to_string(first) + " to " + std::to_string(last));
      }
      chart.series.push_back(std::move(steps));
    }
    const std::string svg = study::toSvg(chart, 560, 240);
    if (!options_.singleFile) curves_[name] = svg;
    const std::string source =
        options_.singleFile
            ? dataAddress("image/svg+xml", std::as_bytes(std::span(svg.data(), svg.size())))
            : "curves/" + text(name) + ".svg";
    return "<p><img class=\"curve\" loading=\"lazy\" src=\"" + source +
           "\" alt=\"time of the last nights against the anchor build\"></p>\n" +
           (words.empty() ? ""
                          : "<p class=\"soft\">" + words +
                                ". The places where levels change are hints only.</p>\n");
  }

  /// Where tonight's time goes: steps explain, they are no verdict.
  std::string steps(const CaseFacts& facts) const {
    std::map<std::string, double> mean;
    for (const auto& [number, frame] : facts.frames)
      for (const auto& [step, seconds] : frame.steps)
        mean[step] += 1e3 * seconds / static_cast<double>(facts.frames.size());
    if (mean.empty()) return "";
    std::vector<std::pair<double, std::string>> order;
    for (const auto& [step, ms] : mean) order.emplace_back(-ms, step);
    std::sort(order.begin(), order.end());
    report::Table table{"", {{"step"}, {"ms a frame", true}}, {}, {}};
    for (const auto& [ms, step] : order) table.rows.push_back({step, report::fixedText(-ms, 2)});
    return folded("Steps of tonight’s first round", table, false);
  }

  /// `changedScene`: accepted frames are those of the scene before.
  std::string figures(const CaseFacts& facts, const std::vector<Verdict>& frames,
                      bool changedScene) {
    std::map<int, Reference> references;
    if (!frames.empty()) {
      const auto before =
          changedScene ? history_.acceptedBench(facts.name) : std::pair(facts.bench, std::string());
      if (before) references = history_.references(facts.name, before->first);
    }
    std::string html;
    int shown = 0;
    for (const Verdict& verdict : frames) {
      const auto frame = facts.frames.find(verdict.frame);
      if (frame == facts.frames.end() || shown == kShownFrames) continue;
      const auto reference = references.find(verdict.frame);
      const FramePictures pictures =
          pictures_.write(facts.name, frame->second, verdict.frame,
                          reference == references.end() ? nullptr : &reference->second);
      const std::string one = figure(facts, verdict, pictures);
      if (one.empty()) continue;
      html += one;
      ++shown;
    }
    if (static_cast<int>(frames.size()) > shown && shown > 0)
      html += "<p class=\"soft\">" + std::to_string(static_cast<int>(frames.size()) - shown) +
              " more frames differ; their files are in the history’s folder.</p>\n";
    return html;
  }

  std::string figure(const CaseFacts& facts, const Verdict& verdict,
                     const FramePictures& pictures) const {
    const auto view = [](const char* kind, const std::string& label, const std::string& source) {
      return source.empty() ? ""
                            : "<div class=\"view " + std::string(kind) +
                                  "\"><div class=\"scroll\"><img loading=\"lazy\" src=\"" + source +
                                  "\" alt=\"" + kind + "\"></div><span class=\"soft\">" + label +
                                  "</span></div>\n";
    };
    const std::string views = view("accepted", "accepted", pictures.accepted) +
                              view("tonight", "tonight", pictures.tonight) +
                              view("gained", "difference × 50", pictures.difference) +
                              view("flip", "HDR-FLIP", pictures.flip);
    if (views.empty()) return "";
    std::string data;
    for (const auto& [name, source] : pictures.exposures)
      data += " data-" + name + "=\"" + source + "\"";
    report::Table reflectors{"", {{"reflector"}, {"mean difference, steps", true}}, {}, {}};
    for (const auto& [id, steps] : pictures.comparison.reflectors)
      if (steps > 0.0)
        reflectors.rows.push_back({objectName(facts, id), report::fixedText(steps, 3)});
    report::Table measures{"", {{""}, {"", true}}, {}, {}};
    for (const auto& [name, value] : pictures.comparison.errors)
      measures.rows.push_back({name, report::fixedText(value, 4)});
    return "<figure class=\"frame\"" + data + ">\n<figcaption>Frame " +
           std::to_string(verdict.frame) + ": " + text(verdict.status) +
           "</figcaption>\n<div class=\"views\">" + views + "</div>\n" +
           folded("Measures", measures, false) +
           folded("Reflectors that differ", reflectors, true) + "</figure>\n";
  }

  static std::string objectName(const CaseFacts& facts, int id) {
    const std::string begin = "object " + std::to_string(id) + " ";
    const std::size_t at = facts.description.find(begin);
    if (at == std::string::npos) return "object " + std::to_string(id);
    const std::size_t from = at + begin.size();
    return facts.description.substr(from, facts.description.find('\n', from) - from);
  }

  std::string table() const {
    const std::vector<std::string> kinds = {"run",     "time",    "creep", "picture",
                                            "flicker", "counter", "memory"};
    std::string html = "<h2>All cases</h2>\n<div class=\"wide\"><table>\n<tr><th>case</th>";
    for (const std::string& kind : kinds) html += "<th>" + kind + "</th>";
    html += "</tr>\n";
    for (const CaseVerdicts& one : cases_) {
      html += "<tr " + attributes(one) + "><td>" +
              (one.outcome == Outcome::Good
                   ? text(one.name)
                   : "<a href=\"#" + text(one.name) + "\">" + text(one.name) + "</a>") +
              "</td>";
      for (const std::string& kind : kinds) html += cell(one, kind);
      html += "</tr>\n";
    }
    return html + "</table></div>\n";
  }

  static std::string cell(const CaseVerdicts& one, const std::string& kind) {
    const Verdict* worst = nullptr;
    for (const Verdict& verdict : one.verdicts)
      if ((verdict.kind == kind || (kind == "run" && verdict.kind == "scene")) &&
          (worst == nullptr || outcomeOf(verdict) > outcomeOf(*worst)))
        worst = &verdict;
    if (worst == nullptr) return "<td></td>";
    const bool ratio = worst->value > 0.0 &&
                       (kind == "time" || kind == "creep" || kind == "memory" || kind == "flicker");
    return "<td class=\"" + std::string(outcomeName(outcomeOf(*worst))) + "\">" +
           text(worst->status) + (ratio ? " " + report::fixedText(worst->value, 3) : "") + "</td>";
  }

  std::string acknowledgements() const {
    std::size_t bytes = 0;
    report::Table table{
        "", {{"number", true}, {"when"}, {"who"}, {"what"}, {"reason"}, {"taken back"}}, {}, {}};
    for (const Acknowledgement& one : history_.acknowledgements()) {
      table.rows.push_back(
          {std::to_string(one.id), one.at, one.who, one.what, one.reason, one.undone});
      bytes += one.what.size() + one.reason.size() + 100;
      if (bytes > 100'000) break;
    }
    return table.rows.empty() ? ""
                              : "<h2>What people accepted</h2>\n" + report::htmlTable(table, text);
  }

  std::string notes() const {
    std::string note =
        "<h2>How it was measured</h2>\n<p class=\"soft\">Times are those of tonight’s build "
        "against "
        "kept older builds, frame by frame in turns in the same night. A time fails when its whole "
        "interval is beyond the gate, again in fresh processes. Pictures are compared with frames "
        "that a person accepted.</p>\n";
    if (pictures_.leftOut() > 0)
      note += "<p class=\"soft\">" + std::to_string(pictures_.leftOut()) + " figures are left out" +
              (options_.singleFile ? " for the size of this file; the folder has them"
                                   : ": their frames are gone") +
              ".</p>\n";
    return note;
  }

  const History& history_;
  const Night& night_;
  const PageOptions& options_;
  std::vector<CaseVerdicts> cases_;
  Summary summary_;
  PictureWriter pictures_;
  std::string articles_;
  std::map<std::string, std::string> curves_;
};

/// Pictures and curves of the last page are removed, and the page is replaced: nobody else's may
/// be.
void requireOurs(const fs::path& out, bool singleFile) {
  std::error_code error;
  const fs::path page = out / "index.html";
  if (fs::is_regular_file(page, error)) {
    const std::vector<std::byte> bytes = readFile(page);
    if (std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()).find(kMark) ==
        std::string_view::npos)
      throw OutputError(page.string() +
                        ": exists and is not a page of nightly; choose another folder for --html");
  }
  if (singleFile) return;
  if (fs::exists(out / "nightly.css", error)) return;
  for (const char* name : {"pictures", "curves"})
    if (fs::exists(out / name, error) && !fs::is_empty(out / name, error))
      throw OutputError((out / name).string() +
                        ": exists and is not a page of nightly; choose another folder for --html");
}

}  // namespace

fs::path writePage(const History& history, const Night& night, const std::vector<Verdict>& verdicts,
                   const PageOptions& options) {
  std::error_code error;
  fs::create_directories(options.out, error);
  if (error) throw OutputError(options.out.string() + ": cannot be created: " + error.message());
  fs::path file = options.out / "index.html";
  requireOurs(options.out, options.singleFile);
  if (!options.singleFile) {
    writeFileAtomically(options.out / "nightly.css", std::string_view(kPageStyle));
    for (const char* name : {"pictures", "curves"}) {
      removeFiles(options.out / name, [](const std::string& relative) {
        return relative.ends_with(".png") || relative.ends_with(".svg");
      });
      fs::create_directories(options.out / name, error);
      if (error) throw OutputError((options.out / name).string() + ": " + error.message());
    }
  }
  PageWriter writer(history, night, verdicts, options);
  const std::string page = writer.page();
  if (options.singleFile && page.size() > kSingleFileBytes)
    throw OutputError(file.string() + ": the page would have " + std::to_string(page.size()) +
                      " bytes; do not use --single-file");
  if (!options.singleFile) {
    for (const auto& [name, svg] : writer.curves())
      writeFileAtomically(options.out / "curves" / (name + ".svg"), std::string_view(svg));
    writeFileAtomically(options.out / "nightly.js", std::string_view(kPageScript));
  }
  writeFileAtomically(file, std::string_view(page));
  return file;
}

}  // namespace catoptric::nightly
