// A suite: runs of configs, and tables and curves whose cells are computed from them. Rendered data
// is stored, so text and tables can be regenerated without rendering.
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

struct SuiteRun : StatedRun {
  bool times = true;           ///< false: errors and counters only
  bool mayRefuse = false;      ///< methods that do not support the scene are named, and left out
  config::Value scenePatch{};  ///< JSON patch for the scene's description [RFC 6902], or null
  config::Value pathPatch{};
  std::string stated{};  ///< settings, reference and times as written in the suite
};

struct Suite {
  std::string title;
  std::string text;
  std::vector<SuiteRun> runs;
  std::map<std::string, Settings> efforts;  ///< settings of all runs, by effort
  config::Value checks;                     ///< items {"value", "from", "to"}
  std::vector<config::Value> tables;        ///< {"title", "text", "columns", "rows"}
  std::vector<config::Value> figures;       ///< {"title", "x", "y", "values", "series", "file"} or
                                            ///< {"of_table", "y", "panels", "file"}
  config::Value pictures;                   ///< see study/suite_pictures.h
};

/// The error measure by which front(...) and take(...) compare methods.
inline constexpr const char* kChoiceMetric = "L1_8bit";

/// The number with three significant digits; empty if it is not finite.
std::string threeDigits(double value);

/// Throws UsageError with the place of the error.
Suite readSuite(const std::filesystem::path& file);
/// Text of a JSON Schema of suites.
std::string suiteJsonSchema();

/// The settings of a run for an effort. A patched scene or path is written to `folder`, together
/// with links to the folders beside the original file, so that names of files in it stay valid. If
/// the effort uses another scene, nothing is patched.
Settings settingsOf(const SuiteRun& run, const Settings& ofEffort,
                    const std::filesystem::path& folder);

/// The measured data from which cells are computed: by run, then by method.
class SuiteData {
 public:
  struct Entry {
    Setting setting;
    const Samples* samples = nullptr;  ///< null: errors only
    std::size_t index = 0;
    std::string base;  ///< key of the setting with which all settings of the run were interleaved
    PointErrors errors;
    std::vector<int> frames;
    int amortize = 1;                            ///< frames of mean_ms()
    std::map<int, std::string> reflectors = {};  ///< names of reflective objects by id
    std::string refused = {};  ///< why the method does not support the scene; then nothing else
  };
  std::map<std::string, std::map<std::string, Entry>> runs;
  /// Text and number of a cell that are known without a measurement.
  struct Stored {
    std::string text;
    double number = 0.0;
  };
  std::map<std::string, Stored> stored;  ///< by the cell's text
  std::vector<config::Value> figures;    ///< the suite's curves, for cells slope(...)
  /// Whether the effort uses another scene, in which objects that cells name may be missing.
  bool otherScenes = false;

  /// The text of a cell such as "ms(paths.second_order)". Text that is not a call is returned
  /// unchanged. Throws UsageError with the place of `cell`.
  std::string cell(const config::Value& cell) const;
  double number(const config::Value& cell) const;

 private:
  const Entry& entry(const std::string& name, const config::Value& cell) const;
  static void requireTurns(const std::string& one, const std::string& other,
                           const config::Value& cell);
  static Ratio ratioOf(const Entry& one, const Entry& other, const TimeKind& kind = {});
  /// The measured entries of a run that "RUN.*" names.
  std::vector<const Entry*> measuredOf(const std::string& name, const config::Value& cell) const;
  Stored front(const std::vector<std::string>& arguments, const config::Value& cell) const;
  Stored take(const std::vector<std::string>& arguments, const config::Value& cell) const;
  std::vector<double> valuesOf(const std::vector<std::string>& arguments,
                               const config::Value& cell) const;
  double slopeOf(const std::vector<std::string>& arguments, const config::Value& cell) const;
  static std::vector<double> stepSeconds(const Entry& one, const std::string& steps);
  static double perCounter(const Entry& one, const std::string& counter, const std::string& other,
                           const std::vector<int>& frames);
  double errorOf(const Entry& one, const std::string& object, const config::Value& cell) const;
};

/// The suite's tables: one with "each" becomes a table with a row for each of these runs; if its
/// row names METHOD, a table for each run, with a row for each method.
std::vector<config::Value> expandedTables(const std::vector<config::Value>& tables,
                                          const std::vector<SuiteRun>& runs);

/// The suite with these of its tables alone (numbers from 1), and the figures of whose curves they
/// have slopes. Throws UsageError.
Suite withTablesAlone(Suite suite, const std::vector<int>& numbers);

/// All computed cells of the suite, in tables, figures, labels and checks, without duplicates.
std::vector<std::string> callsOf(const Suite& suite);
/// The runs and methods that a cell refers to: "ratio(a.x, a.y)" yields (a, x) and (a, y).
std::vector<std::pair<std::string, std::string>> methodsOfCell(const std::string& cell);
/// The error measures that the suite's cells ask of a run.
std::vector<std::string> metricsOf(const Suite& suite, const std::string& run);

/// The checks of the suite that fail, one line each.
std::vector<std::string> failedChecks(const Suite& suite, const SuiteData& data);

/// The page with its tables replaced: the text between the lines "<!-- table 2 -->" and "<!-- end
/// -->" becomes table 2. Throws UsageError if a mark names a table that does not exist.
std::string withTables(const std::string& page, const std::vector<report::Table>& tables,
                       const std::string& name);

std::vector<report::Table> suiteTables(const Suite& suite, const SuiteData& data);
/// The charts of a figure: one of curves, or small ones in several columns.
struct SuiteFigure {
  std::vector<Chart> charts;
  int columns = 1;
  std::string file = {};  ///< the name of a file for this figure alone; empty: none
  std::string svg() const;
};
std::vector<SuiteFigure> suiteFigures(const Suite& suite, const SuiteData& data);

}  // namespace catoptric::study
