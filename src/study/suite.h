// A suite: runs of configs, and tables and curves whose cells are computed from them. What was
// rendered is kept; text and tables are made again without rendering.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "config/json.h"
#include "report/table.h"
#include "study/bench.h"
#include "study/chart.h"
#include "study/suite_run.h"

namespace catoptric::study {

/// A run of a suite.
struct SuiteRun : StatedRun {
  bool times = true;           ///< false: errors and counters alone
  config::Value scenePatch{};  ///< of the scene's description [RFC 6902]; or null
  config::Value pathPatch{};
  std::string stated{};  ///< settings, reference and times as they are written
};

struct Suite {
  std::string title;
  std::string text;
  std::vector<SuiteRun> runs;
  std::map<std::string, Settings> efforts;  ///< settings of all runs, by effort
  config::Value checks;                     ///< of {"value", "from", "to"}
  config::Value tables;                     ///< of {"title", "text", "columns", "rows"}
  config::Value figures;                    ///< of {"title", "x", "y", "values", "series", "file"}
  config::Value pictures;                   ///< study/suite_pictures.h
};

/// With three significant digits; empty where it is not finite.
std::string threeDigits(double value);

/// Throws UsageError with the place of what is wrong.
Suite readSuite(const std::filesystem::path& file);

/// The settings of a run in an effort. A patched scene or path is written to `folder`, with links
/// to the folders beside it; not where the effort has another scene.
Settings settingsOf(const SuiteRun& run, const Settings& ofEffort,
                    const std::filesystem::path& folder);

/// The measured runs, for the cells: by run, by method.
class SuiteData {
 public:
  struct Entry {
    Setting setting;
    const Samples* samples = nullptr;  ///< null: only errors
    std::size_t index = 0;
    std::string base;  ///< key of the setting that all of the run were measured beside
    PointErrors errors;
    std::vector<int> frames;
    std::map<int, std::string> reflectors = {};  ///< names of reflective objects by id
  };
  std::map<std::string, std::map<std::string, Entry>> runs;
  /// A cell's text and number that are known without a measurement.
  struct Stored {
    std::string text;
    double number = 0.0;
  };
  std::map<std::string, Stored> stored;  ///< by the cell's text
  config::Value figures;                 ///< of the suite, for slopes
  /// The effort has a scene of its own, in which objects that cells name may be missing.
  bool otherScenes = false;

  /// The value of a cell such as "ms(paths.second_order)"; text that is no call is itself. Throws
  /// UsageError: `cell` has the place.
  std::string cell(const config::Value& cell) const;
  double number(const config::Value& cell) const;

 private:
  const Entry& entry(const std::string& name, const config::Value& cell) const;
  static Ratio ratioOf(const Entry& one, const Entry& other);
  std::vector<double> valuesOf(const std::vector<std::string>& arguments,
                               const config::Value& cell) const;
  double slopeOf(const std::vector<std::string>& arguments, const config::Value& cell) const;
  static std::vector<double> stepSeconds(const Entry& one, const std::string& steps);
  static double perCounter(const Entry& one, const std::string& counter, const std::string& other,
                           const std::vector<int>& frames);
  double errorOf(const Entry& one, const std::string& object, const config::Value& cell) const;
};

/// All cells of the suite that are computed: of tables, figures, labels and checks, each once.
std::vector<std::string> callsOf(const Suite& suite);
/// Runs and methods that a cell names: "ratio(a.x, a.y)" has (a, x) and (a, y).
std::vector<std::pair<std::string, std::string>> methodsOfCell(const std::string& cell);

/// What of the suite's checks does not hold, a line each.
std::vector<std::string> failedChecks(const Suite& suite, const SuiteData& data);

/// A page with its tables replaced: what stands between the lines "<!-- table 2 -->" and "<!-- end
/// -->" becomes table 2. Throws UsageError for marks of tables that are not there.
std::string withTables(const std::string& page, const std::vector<report::Table>& tables,
                       const std::string& name);

/// Tables of the suite, those that `only` names by their numbers from 1, or all.
std::vector<report::Table> suiteTables(const Suite& suite, const SuiteData& data,
                                       const std::vector<int>& only);
/// `file`: empty, or the name of a file for this curve alone.
struct SuiteChart {
  Chart chart;
  std::string file;
};
std::vector<SuiteChart> suiteCharts(const Suite& suite, const SuiteData& data);

}  // namespace catoptric::study
