// Chooses the night that a process works on: a new or an unfinished one.
#pragma once

#include "nightly/history.h"

namespace catoptric::nightly {

/// A night that belongs to this process alone while this object exists.
class OpenNight {
 public:
  /// Continues an unfinished night of the same suite, effort, machine and build whose process has
  /// ended; otherwise begins `wanted`. Throws OutputError.
  OpenNight(History& history, const Night& wanted);
  ~OpenNight();
  OpenNight(const OpenNight&) = delete;
  OpenNight& operator=(const OpenNight&) = delete;

  const Night& night() const { return night_; }
  bool resumed() const { return resumed_; }

 private:
  bool take(const History& history, int id);

  Night night_;
  bool resumed_ = false;
  int lock_ = -1;
};

}  // namespace catoptric::nightly
