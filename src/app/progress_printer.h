// Progress of a run, on stderr: a bar on a terminal, lines elsewhere, or JSON lines.
#pragma once

#include <cstdint>
#include <string>

#include "run/sequence/sequence.h"

namespace catoptric::app {

enum class ProgressMode { None, Bar, Plain, Json };

/// What --progress asks for. "auto": a bar when stderr is a terminal, plain lines otherwise,
/// nothing with --quiet; what is named stays with --quiet. Throws UsageError.
ProgressMode parseProgress(const std::string& text, bool quiet);

/// "1:02:03", "4:05", "12 s", "0.8 s".
std::string durationText(double seconds);

/// Prints progress between the lines of the log, which a bar makes room for. With
/// ProgressMode::Json messages are JSON lines too, from then on. One at a time; any thread.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(ProgressMode mode);
  ~ProgressPrinter();
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  void show(const std::string& method, const run::Progress& progress);
  /// A long step before the first frame, such as "bake", of which a share 0..1 is done.
  void showStep(const std::string& step, double share);
  /// Leaves the bar's line, before anything else is printed.
  void endLine();

 private:
  bool due(std::int64_t intervalNs);
  void showBar(const std::string& name, double share, const std::string& text);
  void finishBar();

  ProgressMode mode_;
  std::string bar_;  ///< on the terminal's last line; empty: none
  std::int64_t lastNs_ = 0;
  std::string lastMethod_;
  std::string lastStep_;
  std::int64_t stepStartNs_ = 0;
};

}  // namespace catoptric::app
