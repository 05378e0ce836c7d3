// Which night a process works on: the one that it began, or one that another has left unfinished.
#pragma once

#include "nightly/history.h"

namespace catoptric::nightly {

/// A night that is this process's alone, until it ends.
class OpenNight {
 public:
  /// Goes on with an unfinished night of the same suite, effort, machine and build whose process
  /// has ended, or begins `wanted`. Throws OutputError.
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
