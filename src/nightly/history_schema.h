// The tables of a history. Each change gets a new version number and a migration from the previous
// version.
#pragma once

namespace catoptric::nightly {

inline constexpr int kSchemaVersion = 1;

inline constexpr const char* kSchema = R"(
CREATE TABLE machine (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE) STRICT;
CREATE TABLE build (id INTEGER PRIMARY KEY, fingerprint TEXT NOT NULL UNIQUE,
  version TEXT NOT NULL DEFAULT '') STRICT;
CREATE TABLE night (id INTEGER PRIMARY KEY AUTOINCREMENT, suite TEXT NOT NULL,
  suite_print TEXT NOT NULL, effort TEXT NOT NULL, machine INTEGER NOT NULL REFERENCES machine,
  build INTEGER NOT NULL REFERENCES build, started TEXT NOT NULL, finished TEXT,
  partial INTEGER NOT NULL) STRICT;
CREATE TABLE bench (id INTEGER PRIMARY KEY, name TEXT NOT NULL, print TEXT NOT NULL,
  description TEXT NOT NULL, UNIQUE (name, print)) STRICT;
CREATE TABLE result (id INTEGER PRIMARY KEY, night INTEGER NOT NULL REFERENCES night,
  bench INTEGER NOT NULL REFERENCES bench, failure TEXT NOT NULL, baseline_failures TEXT NOT NULL,
  memory TEXT NOT NULL, command TEXT NOT NULL, truth TEXT NOT NULL, UNIQUE (night, bench)) STRICT;
CREATE TABLE sample (id INTEGER PRIMARY KEY, result INTEGER NOT NULL REFERENCES result,
  role TEXT NOT NULL, attempt INTEGER NOT NULL, build INTEGER NOT NULL REFERENCES build,
  times TEXT NOT NULL, thinned INTEGER NOT NULL DEFAULT 0) STRICT;
CREATE INDEX sample_of_result ON sample (result);
CREATE TABLE frame (id INTEGER PRIMARY KEY, result INTEGER NOT NULL REFERENCES result,
  frame INTEGER NOT NULL, pixels TEXT NOT NULL, counters TEXT NOT NULL, steps TEXT NOT NULL,
  file TEXT NOT NULL, bytes INTEGER NOT NULL, not_finite INTEGER NOT NULL,
  UNIQUE (result, frame)) STRICT;
CREATE TABLE acknowledgement (id INTEGER PRIMARY KEY AUTOINCREMENT, at TEXT NOT NULL,
  who TEXT NOT NULL, what TEXT NOT NULL, reason TEXT NOT NULL, undone TEXT) STRICT;
CREATE TABLE reference (id INTEGER PRIMARY KEY, bench INTEGER NOT NULL REFERENCES bench,
  frame INTEGER NOT NULL, pixels TEXT NOT NULL, object TEXT NOT NULL, counters TEXT NOT NULL,
  bytes INTEGER NOT NULL, night INTEGER NOT NULL REFERENCES night,
  acknowledgement INTEGER NOT NULL REFERENCES acknowledgement) STRICT;
CREATE INDEX reference_of_bench ON reference (bench);
CREATE TABLE baseline (id INTEGER PRIMARY KEY, bench INTEGER NOT NULL REFERENCES bench,
  machine INTEGER NOT NULL REFERENCES machine, role TEXT NOT NULL,
  build INTEGER NOT NULL REFERENCES build, night INTEGER NOT NULL REFERENCES night,
  acknowledgement INTEGER REFERENCES acknowledgement) STRICT;
CREATE INDEX baseline_of_bench ON baseline (bench, machine, role);
CREATE TABLE verdict (id INTEGER PRIMARY KEY, night INTEGER NOT NULL REFERENCES night,
  name TEXT NOT NULL, kind TEXT NOT NULL, status TEXT NOT NULL, outcome INTEGER NOT NULL,
  frame INTEGER NOT NULL, value REAL NOT NULL, low REAL NOT NULL, high REAL NOT NULL,
  message TEXT NOT NULL, began INTEGER NOT NULL, last_good TEXT NOT NULL, first_bad TEXT NOT NULL,
  acknowledgement INTEGER REFERENCES acknowledgement, UNIQUE (night, name, kind, frame)) STRICT;
CREATE INDEX verdict_of_case ON verdict (name, kind, night);
)";

}  // namespace catoptric::nightly
