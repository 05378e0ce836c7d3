// Progress of a run, on stderr: a bar on a terminal, lines elsewhere, or JSON lines.
#pragma once

#include <cstdint>
#include <string>

#include "run/sequence/sequence.h"

namespace catoptric::app {

enum class ProgressMode { None, Bar, Plain, Json };

/// "auto": a bar when stderr is a terminal, plain otherwise. Throws UsageError.
ProgressMode parseProgress(const std::string& text);

/// "1:02:03", "4:05", "12 s", "0.8 s".
std::string durationText(double seconds);

class ProgressPrinter {
 public:
  explicit ProgressPrinter(ProgressMode mode) : mode_(mode) {}
  ~ProgressPrinter() { endLine(); }
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  void show(const std::string& method, const run::Progress& progress);
  /// Leaves the bar's line, before anything else is printed.
  void endLine();

 private:
  ProgressMode mode_;
  bool onLine_ = false;
  std::int64_t lastNs_ = 0;
  std::string lastMethod_;
};

}  // namespace catoptric::app
