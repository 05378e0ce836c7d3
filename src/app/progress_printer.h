// Shows the progress of a run on stderr: a bar on a terminal, otherwise lines, or JSON lines.
#pragma once

#include <cstdint>
#include <string>

#include "run/sequence/sequence.h"

namespace catoptric::app {

enum class ProgressMode { None, Bar, Plain, Json };

/// The mode for a value of --progress. "auto": a bar if stderr is a terminal, otherwise plain
/// lines; nothing with --quiet. The other modes also apply with --quiet. Throws UsageError.
ProgressMode parseProgress(const std::string& text, bool quiet);

/// For example "1:02:03", "4:05", "12 s", "0.8 s".
std::string durationText(double seconds);

/// Prints progress between the lines of the log; a bar is removed while a log line is printed. With
/// ProgressMode::Json, log messages become JSON lines too. Only one printer may exist at a time.
/// Any thread may use it.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(ProgressMode mode);
  ~ProgressPrinter();
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  void show(const std::string& method, const run::Progress& progress);
  /// Shows a long step before the first frame, such as "bake"; `share`: fraction done, 0..1.
  void showStep(const std::string& step, double share);
  /// Ends the bar's line, before anything else is printed.
  void endLine();

 private:
  bool due(std::int64_t intervalNs);
  void showBar(const std::string& name, double share, const std::string& text);
  void finishBar();

  ProgressMode mode_;
  std::string bar_;  ///< the bar on the terminal's last line; empty: none
  std::int64_t lastNs_ = 0;
  std::string lastMethod_;
  std::string lastStep_;
  std::int64_t stepStartNs_ = 0;
};

}  // namespace catoptric::app
