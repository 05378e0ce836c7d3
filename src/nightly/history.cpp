#include "nightly/history.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sys/vfs.h>

#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <sstream>

#include "config/json.h"
#include "config/json_text.h"
#include "core/error.h"
#include "nightly/history_schema.h"
#include "report/table.h"

namespace catoptric::nightly {
namespace {

namespace fs = std::filesystem;
using SQLite::Database, SQLite::Statement;

/// How long a writer waits for others: with 0 half of eight writers' rows were lost, with this
/// none.
constexpr int kBusyMs = 10000;
constexpr int kApplication = 0x6361746f;  ///< "cato", of our files

/// File systems on which SQLite's locks cannot be relied on.
void refuseNetwork(const fs::path& folder) {
  struct statfs info {};
  if (::statfs(folder.c_str(), &info) != 0) return;
  constexpr std::array<unsigned, 6> kNetwork = {0x6969,     0x517B,     0xFF534D42,
                                                0xFE534D42, 0x01021997, 0x564c};
  for (const unsigned type : kNetwork)
    if (static_cast<unsigned>(info.f_type) == type)
      throw UsageError(folder.string() +
                       ": is on a network file system, where SQLite's locks cannot be relied on; "
                       "name a file on a local disk with --history");
}

[[noreturn]] void fail(const fs::path& file, const SQLite::Exception& error) {
  const std::string what = file.string() + ": ";
  switch (error.getErrorCode()) {
    case 11:  // SQLITE_CORRUPT
    case 26:  // SQLITE_NOTADB
      throw UsageError(what + "the history is damaged (" + error.what() +
                       "); put a copy in its place, or begin another one with --history");
    case 5:  // SQLITE_BUSY
      throw OutputError(what + "another process has kept the history locked for 10 s; try again");
    case 13:  // SQLITE_FULL
      throw OutputError(what + "the disk is full; nothing was changed");
    case 8:   // SQLITE_READONLY
    case 14:  // SQLITE_CANTOPEN
      throw OutputError(what + "the history, or its folder, cannot be written (" + error.what() +
                        ")");
    default:
      throw OutputError(what + error.what());
  }
}

std::string countersText(const std::map<std::string, std::uint64_t>& counters) {
  return config::JsonText().add("c", counters).object();
}

std::map<std::string, std::uint64_t> parseCounters(const std::string& text) {
  std::map<std::string, std::uint64_t> counters;
  const config::Value value = config::parseText(text, "counters").get("c");
  for (const std::string& name : value.keys())
    counters[name] = static_cast<std::uint64_t>(value.get(name).asNumber());
  return counters;
}

std::string stepsText(const std::map<std::string, double>& steps) {
  config::JsonText text;
  for (const auto& [name, seconds] : steps) text.add(name, seconds);
  return text.object();
}

std::map<std::string, double> parseSteps(const std::string& text) {
  std::map<std::string, double> steps;
  const config::Value value = config::parseText(text, "steps");
  for (const std::string& name : value.keys())
    if (!value.get(name).isNull()) steps[name] = value.get(name).asNumber();
  return steps;
}

template <class... T>
void run(Database& database, const char* sql, const T&... values) {
  Statement statement(database, sql);
  int index = 0;
  (statement.bind(++index, values), ...);
  statement.exec();
}

/// Columns of verdict from `first` on.
Verdict readVerdict(const Statement& row, int first) {
  Verdict verdict;
  verdict.name = row.getColumn(first).getString();
  verdict.kind = row.getColumn(first + 1).getString();
  verdict.status = row.getColumn(first + 2).getString();
  verdict.outcome = static_cast<Outcome>(row.getColumn(first + 3).getInt());
  verdict.frame = row.getColumn(first + 4).getInt();
  verdict.value = row.getColumn(first + 5).getDouble();
  verdict.low = row.getColumn(first + 6).getDouble();
  verdict.high = row.getColumn(first + 7).getDouble();
  verdict.message = row.getColumn(first + 8).getString();
  verdict.began = row.getColumn(first + 9).getInt();
  verdict.lastGood = row.getColumn(first + 10).getString();
  verdict.firstBad = row.getColumn(first + 11).getString();
  verdict.acknowledgement = row.getColumn(first + 12).getInt();
  return verdict;
}

#define VERDICT_COLUMNS                                                               \
  "v.name, v.kind, v.status, v.outcome, v.frame, v.value, v.low, v.high, v.message, " \
  "v.began, v.last_good, v.first_bad, coalesce((SELECT a.id FROM acknowledgement a "  \
  "WHERE a.id = v.acknowledgement AND a.undone IS NULL), 0)"

constexpr const char* kNightColumns =
    "SELECT n.id, n.suite, n.suite_print, n.effort, m.name, b.fingerprint, b.version, n.started, "
    "coalesce(n.finished, ''), n.partial FROM night n JOIN machine m ON m.id = n.machine "
    "JOIN build b ON b.id = n.build ";

Night readNight(const Statement& row) {
  return {row.getColumn(0).getInt(),     row.getColumn(1).getString(), row.getColumn(2).getString(),
          row.getColumn(3).getString(),  row.getColumn(4).getString(), row.getColumn(5).getString(),
          row.getColumn(6).getString(),  row.getColumn(7).getString(), row.getColumn(8).getString(),
          row.getColumn(9).getInt() != 0};
}

}  // namespace

std::string utcNow() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text.data();
}

std::string timesText(const study::RoundTimes& times) {
  std::string text;
  for (const std::vector<double>& round : times) {
    for (std::size_t i = 0; i < round.size(); ++i)
      text += (i == 0 ? "" : " ") + report::exactText(round[i]);
    text += "\n";
  }
  return text;
}

study::RoundTimes parseTimes(const std::string& text) {
  study::RoundTimes times;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::vector<double>& round = times.emplace_back();
    for (double seconds = 0.0; words >> seconds;) round.push_back(seconds);
  }
  return times;
}

History::History(const fs::path& file, Mode mode)
    : file_(file), folder_(file.has_parent_path() ? file.parent_path() : fs::path(".")) {
  std::error_code error;
  if (mode == Mode::Create) {
    fs::create_directories(folder_, error);
    if (error) throw OutputError(folder_.string() + ": cannot be made: " + error.message());
  } else if (!fs::is_regular_file(file, error)) {
    throw UsageError(file.string() +
                     ": there is no history; `catoptric nightly SUITE` begins one, or name "
                     "another with --history");
  }
  refuseNetwork(folder_);
  const int flags = mode == Mode::Read
                        ? SQLite::OPEN_READONLY
                        : SQLite::OPEN_READWRITE | (mode == Mode::Create ? SQLite::OPEN_CREATE : 0);
  try {
    database_ = std::make_unique<Database>(file.string(), flags, kBusyMs);
    database_->exec("PRAGMA foreign_keys = ON");
    SQLite::Transaction look(*database_);  // another process may be making the tables
    const int application = database_->execAndGet("PRAGMA application_id").getInt();
    const int version = database_->execAndGet("PRAGMA user_version").getInt();
    const bool empty = database_->execAndGet("SELECT count(*) FROM sqlite_master").getInt() == 0;
    look.commit();
    if (!empty && application != kApplication)
      throw UsageError(file.string() + ": is no history of catoptric; name another file");
    if (version > kSchemaVersion)
      throw UsageError(file.string() + ": was written by a newer catoptric (version " +
                       std::to_string(version) + " of the history, this program knows " +
                       std::to_string(kSchemaVersion) + ")");
    if (mode != Mode::Read && version < kSchemaVersion) {
      write([](Database& database) {  // another process may have done it meanwhile
        if (database.execAndGet("PRAGMA user_version").getInt() >= kSchemaVersion) return;
        database.exec(kSchema);
        database.exec("PRAGMA application_id = " + std::to_string(kApplication));
        database.exec("PRAGMA user_version = " + std::to_string(kSchemaVersion));
      });
    }
    const std::string check = database_->execAndGet("PRAGMA quick_check(1)").getString();
    if (check != "ok")
      throw UsageError(file.string() + ": the history is damaged (" + check +
                       "); put a copy in its place, or begin another one with --history");
  } catch (const SQLite::Exception& exception) {
    fail(file_, exception);
  }
}

History::~History() = default;

void History::write(const std::function<void(Database&)>& change) {
  try {
    SQLite::Transaction transaction(*database_, SQLite::TransactionBehavior::IMMEDIATE);
    change(*database_);
    transaction.commit();
  } catch (const SQLite::Exception& exception) {
    fail(file_, exception);
  }
}

template <class Read>
auto History::read(const Read& read) const {
  try {
    return read(*database_);
  } catch (const SQLite::Exception& exception) {
    fail(file_, exception);
  }
}

int History::idOf(Database& database, const char* table, const std::string& name) {
  const std::string column = std::string(table) == "build" ? "fingerprint" : "name";
  run(database,
      ("INSERT INTO " + std::string(table) + " (" + column + ") VALUES (?) ON CONFLICT DO NOTHING")
          .c_str(),
      name);
  Statement select(database, "SELECT id FROM " + std::string(table) + " WHERE " + column + " = ?");
  select.bind(1, name);
  select.executeStep();
  return select.getColumn(0).getInt();
}

int History::beginNight(const Night& night) {
  int id = 0;
  write([&](Database& database) {
    const int machine = idOf(database, "machine", night.machine);
    const int build = idOf(database, "build", night.build);
    run(database, "UPDATE build SET version = ? WHERE id = ?", night.version, build);
    run(database,
        "INSERT INTO night (suite, suite_print, effort, machine, build, started, partial) "
        "VALUES (?, ?, ?, ?, ?, ?, ?)",
        night.suite, night.suitePrint, night.effort, machine, build, night.started,
        night.partial ? 1 : 0);
    id = static_cast<int>(database.getLastInsertRowid());
  });
  return id;
}

std::vector<Night> History::nights(const std::string& suite, int limit) const {
  return read([&](Database& database) {
    Statement rows(database, std::string(kNightColumns) +
                                 "WHERE ?1 = '' OR n.suite = ?1 ORDER BY n.id DESC LIMIT ?2");
    rows.bind(1, suite);
    rows.bind(2, limit);
    std::vector<Night> nights;
    while (rows.executeStep()) nights.push_back(readNight(rows));
    return nights;
  });
}

std::optional<Night> History::night(int id) const {
  return read([&](Database& database) -> std::optional<Night> {
    Statement rows(database, std::string(kNightColumns) + "WHERE n.id = ?");
    rows.bind(1, id);
    if (!rows.executeStep()) return {};
    return readNight(rows);
  });
}

void History::addResult(int night, const CaseFacts& facts) {
  write([&](Database& database) {
    run(database,
        "INSERT INTO bench (name, print, description) VALUES (?, ?, ?) ON CONFLICT DO NOTHING",
        facts.name, facts.bench, facts.description);
    config::JsonText failures;
    for (const auto& [role, failure] : facts.baselineFailures) failures.add(role, failure);
    run(database,
        "INSERT INTO result (night, bench, failure, baseline_failures, memory, command, truth) "
        "SELECT ?, id, ?, ?, ?, ?, ? FROM bench WHERE name = ? AND print = ?",
        night, facts.failure, failures.object(), countersText(facts.memory), facts.command,
        facts.truth, facts.name, facts.bench);
    const auto result = static_cast<long>(database.getLastInsertRowid());
    for (const Timing& timing : facts.timings)
      run(database,
          "INSERT INTO sample (result, role, attempt, build, times) VALUES (?, ?, ?, ?, ?)", result,
          timing.role, timing.attempt, idOf(database, "build", timing.build),
          timesText(timing.times));
    for (const auto& [number, frame] : facts.frames)
      run(database,
          "INSERT INTO frame (result, frame, pixels, counters, steps, file, bytes, not_finite) "
          "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
          result, number, frame.pixels, countersText(frame.counters), stepsText(frame.steps),
          frame.file, static_cast<std::int64_t>(frame.bytes),
          static_cast<std::int64_t>(frame.notFinite));
  });
}

std::set<std::string> History::measured(int night) const {
  return read([&](Database& database) {
    Statement rows(database,
                   "SELECT b.name FROM result r JOIN bench b ON b.id = r.bench WHERE r.night = ?");
    rows.bind(1, night);
    std::set<std::string> names;
    while (rows.executeStep()) names.insert(rows.getColumn(0).getString());
    return names;
  });
}

CaseFacts History::result(int night, const std::string& name) const {
  return read([&](Database& database) {
    Statement row(database,
                  "SELECT r.id, b.print, b.description, r.failure, r.baseline_failures, r.memory, "
                  "r.command, r.truth FROM result r JOIN bench b ON b.id = r.bench "
                  "WHERE r.night = ? AND b.name = ?");
    row.bind(1, night);
    row.bind(2, name);
    if (!row.executeStep())
      throw UsageError("night " + std::to_string(night) + " has no case " + name);
    CaseFacts facts;
    facts.name = name;
    const int result = row.getColumn(0).getInt();
    facts.bench = row.getColumn(1).getString();
    facts.description = row.getColumn(2).getString();
    facts.failure = row.getColumn(3).getString();
    const config::Value failures = config::parseText(row.getColumn(4).getString(), "failures");
    for (const std::string& key : failures.keys())
      facts.baselineFailures[key] = failures.get(key).asString();
    facts.memory = parseCounters(row.getColumn(5).getString());
    facts.command = row.getColumn(6).getString();
    facts.truth = row.getColumn(7).getString();
    Statement samples(database,
                      "SELECT s.role, s.attempt, b.fingerprint, s.times FROM sample s "
                      "JOIN build b ON b.id = s.build WHERE s.result = ? ORDER BY s.id");
    samples.bind(1, result);
    while (samples.executeStep())
      facts.timings.push_back({samples.getColumn(0).getString(), samples.getColumn(1).getInt(),
                               samples.getColumn(2).getString(),
                               parseTimes(samples.getColumn(3).getString())});
    Statement frames(database,
                     "SELECT frame, pixels, counters, steps, file, bytes, not_finite FROM frame "
                     "WHERE result = ?");
    frames.bind(1, result);
    while (frames.executeStep())
      facts.frames[frames.getColumn(0).getInt()] = {
          frames.getColumn(1).getString(),
          parseCounters(frames.getColumn(2).getString()),
          parseSteps(frames.getColumn(3).getString()),
          frames.getColumn(4).getString(),
          static_cast<std::uint64_t>(frames.getColumn(5).getInt64()),
          static_cast<std::uint64_t>(frames.getColumn(6).getInt64())};
    return facts;
  });
}

std::optional<std::pair<std::string, std::string>> History::bench(int night,
                                                                  const std::string& name) const {
  return read([&](Database& database) -> std::optional<std::pair<std::string, std::string>> {
    Statement row(database,
                  "SELECT b.print, b.description FROM result r JOIN bench b ON b.id = r.bench "
                  "WHERE r.night = ? AND b.name = ?");
    row.bind(1, night);
    row.bind(2, name);
    if (!row.executeStep()) return {};
    return std::pair(row.getColumn(0).getString(), row.getColumn(1).getString());
  });
}

void History::judge(int night, const std::vector<Verdict>& verdicts,
                    const std::vector<std::pair<std::string, Baseline>>& baselines,
                    const std::string& finished) {
  write([&](Database& database) {
    for (const Verdict& v : verdicts)
      run(database,
          "INSERT INTO verdict (night, name, kind, status, outcome, frame, value, low, high, "
          "message, began, last_good, first_bad) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) "
          "ON CONFLICT DO NOTHING",
          night, v.name, v.kind, v.status, static_cast<int>(v.outcome), v.frame, v.value, v.low,
          v.high, v.message, v.began, v.lastGood, v.firstBad);
    for (const auto& [name, baseline] : baselines)
      run(database,
          "INSERT INTO baseline (bench, machine, role, build, night) SELECT b.id, n.machine, ?, "
          "(SELECT id FROM build WHERE fingerprint = ?), n.id FROM night n JOIN result r ON "
          "r.night = n.id JOIN bench b ON b.id = r.bench WHERE n.id = ? AND b.name = ?",
          baseline.role, baseline.build, night, name);
    run(database, "UPDATE night SET finished = ? WHERE id = ?", finished, night);
  });
}

void History::forget(int night) {
  write([&](Database& database) {
    run(database, "DELETE FROM verdict WHERE night = ? AND acknowledgement IS NULL", night);
    run(database, "DELETE FROM baseline WHERE night = ? AND acknowledgement IS NULL", night);
    run(database, "UPDATE night SET finished = NULL WHERE id = ?", night);
  });
}

std::vector<Verdict> History::verdicts(int night) const {
  return read([&](Database& database) {
    Statement rows(database,
                   "SELECT " VERDICT_COLUMNS " FROM verdict v WHERE v.night = ? ORDER BY v.id");
    rows.bind(1, night);
    std::vector<Verdict> verdicts;
    while (rows.executeStep()) verdicts.push_back(readVerdict(rows, 0));
    return verdicts;
  });
}

std::vector<History::Past> History::past(const std::string& name, const std::string& kind,
                                         const std::string& machine, int night, int limit) const {
  return read([&](Database& database) {
    Statement rows(
        database,
        "SELECT n.id, n.started, b.fingerprint, coalesce((SELECT be.print FROM result r JOIN bench "
        "be ON be.id = r.bench WHERE r.night = n.id AND be.name = v.name), ''), " VERDICT_COLUMNS
        " FROM verdict v JOIN night n ON n.id = v.night JOIN build b ON b.id = n.build JOIN "
        "machine m ON m.id = n.machine WHERE v.name = ? AND v.kind = ? AND m.name = ? AND n.id < ? "
        "ORDER BY n.id DESC, v.frame LIMIT ?");
    rows.bind(1, name);
    rows.bind(2, kind);
    rows.bind(3, machine);
    rows.bind(4, night);
    rows.bind(5, limit);
    std::vector<Past> all;
    while (rows.executeStep())
      all.push_back({rows.getColumn(0).getInt(), rows.getColumn(1).getString(),
                     rows.getColumn(2).getString(), rows.getColumn(3).getString(),
                     readVerdict(rows, 4)});
    return all;
  });
}

std::optional<Baseline> History::baseline(const std::string& name, const std::string& bench,
                                          const std::string& machine,
                                          const std::string& role) const {
  return read([&](Database& database) -> std::optional<Baseline> {
    Statement row(database,
                  "SELECT bu.fingerprint, l.night FROM baseline l JOIN bench b ON b.id = l.bench "
                  "JOIN machine m ON m.id = l.machine JOIN build bu ON bu.id = l.build LEFT JOIN "
                  "acknowledgement a ON a.id = l.acknowledgement WHERE b.name = ? AND b.print = ? "
                  "AND m.name = ? AND l.role = ? AND a.undone IS NULL ORDER BY l.id DESC LIMIT 1");
    row.bind(1, name);
    row.bind(2, bench);
    row.bind(3, machine);
    row.bind(4, role);
    if (!row.executeStep()) return {};
    return Baseline{role, row.getColumn(0).getString(), row.getColumn(1).getInt()};
  });
}

std::map<int, Reference> History::references(const std::string& name,
                                             const std::string& bench) const {
  return read([&](Database& database) {
    Statement rows(
        database,
        "SELECT f.frame, f.pixels, f.object, f.counters, f.bytes, f.night FROM reference "
        "f JOIN bench b ON b.id = f.bench JOIN acknowledgement a ON a.id = "
        "f.acknowledgement WHERE b.name = ? AND b.print = ? AND a.undone IS NULL "
        "ORDER BY f.id");
    rows.bind(1, name);
    rows.bind(2, bench);
    std::map<int, Reference> all;
    while (rows.executeStep()) {
      const int frame = rows.getColumn(0).getInt();
      all[frame] = {frame,
                    rows.getColumn(1).getString(),
                    rows.getColumn(2).getString(),
                    parseCounters(rows.getColumn(3).getString()),
                    static_cast<std::uint64_t>(rows.getColumn(4).getInt64()),
                    rows.getColumn(5).getInt()};
    }
    return all;
  });
}

std::set<std::string> History::buildsInUse() const {
  return read([&](Database& database) {
    Statement rows(database,
                   "SELECT DISTINCT bu.fingerprint FROM build bu WHERE bu.id IN (SELECT l.build "
                   "FROM baseline l WHERE l.id IN (SELECT max(k.id) FROM baseline k LEFT JOIN "
                   "acknowledgement a ON a.id = k.acknowledgement WHERE a.undone IS NULL GROUP BY "
                   "k.bench, k.machine, k.role)) OR bu.id IN (SELECT build FROM night ORDER BY id "
                   "DESC LIMIT 10)");
    std::set<std::string> builds;
    while (rows.executeStep()) builds.insert(rows.getColumn(0).getString());
    return builds;
  });
}

int History::accept(const Acknowledgement& acknowledgement, int night,
                    const std::vector<Acceptance>& accepted) {
  int id = 0;
  write([&](Database& database) {
    run(database, "INSERT INTO acknowledgement (at, who, what, reason) VALUES (?, ?, ?, ?)",
        acknowledgement.at, acknowledgement.who, acknowledgement.what, acknowledgement.reason);
    id = static_cast<int>(database.getLastInsertRowid());
    for (const Acceptance& one : accepted) {
      for (const Reference& frame : one.references)
        run(database,
            "INSERT INTO reference (bench, frame, pixels, object, counters, bytes, night, "
            "acknowledgement) SELECT id, ?, ?, ?, ?, ?, ?, ? FROM bench WHERE name = ? AND print = "
            "?",
            frame.frame, frame.pixels, frame.object, countersText(frame.counters),
            static_cast<std::int64_t>(frame.bytes), night, id, one.name, one.bench);
      for (const Baseline& baseline : one.baselines)
        run(database,
            "INSERT INTO baseline (bench, machine, role, build, night, acknowledgement) SELECT "
            "b.id, n.machine, ?, (SELECT id FROM build WHERE fingerprint = ?), n.id, ? FROM bench "
            "b, night n WHERE n.id = ? AND b.name = ? AND b.print = ?",
            baseline.role, baseline.build, id, night, one.name, one.bench);
      for (const std::string& kind : one.kinds)
        run(database,
            "UPDATE verdict SET acknowledgement = ?1 WHERE night = ?2 AND name = ?3 AND kind = ?4 "
            "AND outcome <> 0 AND (?5 = 0 OR frame = 0 OR frame = ?5)",
            id, night, one.name, kind, one.frame);
    }
  });
  return id;
}

std::vector<Acknowledgement> History::acknowledgements() const {
  return read([&](Database& database) {
    Statement rows(database,
                   "SELECT id, at, who, what, reason, coalesce(undone, '') FROM acknowledgement "
                   "ORDER BY id DESC");
    std::vector<Acknowledgement> all;
    while (rows.executeStep())
      all.push_back({rows.getColumn(0).getInt(), rows.getColumn(1).getString(),
                     rows.getColumn(2).getString(), rows.getColumn(3).getString(),
                     rows.getColumn(4).getString(), rows.getColumn(5).getString()});
    return all;
  });
}

void History::undo(int acknowledgement, const std::string& at) {
  write([&](Database& database) {
    Statement change(database,
                     "UPDATE acknowledgement SET undone = ? WHERE id = ? AND undone IS NULL");
    change.bind(1, at);
    change.bind(2, acknowledgement);
    if (change.exec() == 0)
      throw UsageError("there is no acknowledgement " + std::to_string(acknowledgement) +
                       " that holds; `catoptric nightly log` lists them");
    run(database, "UPDATE verdict SET acknowledgement = NULL WHERE acknowledgement = ?",
        acknowledgement);
  });
}

void History::thinSamples() {
  write([&](Database& database) {
    Statement old(database,
                  "SELECT s.id, s.times FROM sample s JOIN result r ON r.id = s.result WHERE "
                  "s.thinned = 0 AND r.night < (SELECT min(id) FROM (SELECT id FROM night ORDER BY "
                  "id DESC LIMIT ?))");
    old.bind(1, kRawNights);
    while (old.executeStep())
      run(database, "UPDATE sample SET times = ?, thinned = 1 WHERE id = ?",
          timesText({study::frameSeconds(parseTimes(old.getColumn(1).getString())).frames}),
          old.getColumn(0).getInt());
  });
}

}  // namespace catoptric::nightly
