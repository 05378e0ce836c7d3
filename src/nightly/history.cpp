#include "nightly/history.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sys/vfs.h>

#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
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
                       ": is on a network file system, where SQLite's locks are not reliable; give "
                       "a file on a local disk by --history");
}

[[noreturn]] void fail(const fs::path& file, const SQLite::Exception& error) {
  const std::string what = file.string() + ": ";
  switch (error.getErrorCode()) {
    case 11:  // SQLITE_CORRUPT
    case 26:  // SQLITE_NOTADB
      throw UsageError(what + "the history is damaged (" + error.what() +
                       "); restore it from a backup, or start a new one with --history FILE");
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
void bindAll(Statement& statement, const T&... values) {
  int index = 0;
  (statement.bind(++index, values), ...);
}

template <class... T>
void run(Database& database, const char* sql, const T&... values) {
  Statement statement(database, sql);
  bindAll(statement, values...);
  statement.exec();
}

std::string textOf(const Statement& row, int column) {
  return row.getColumn(column).getString();
}

/// Only a damaged file has a number that is out of range.
int intOf(const Statement& row, int column, int least = std::numeric_limits<int>::min(),
          int most = std::numeric_limits<int>::max()) {
  const std::int64_t value = row.getColumn(column).getInt64();
  if (value < least || value > most)
    throw SQLite::Exception("a number is out of range: " + std::to_string(value),
                            11);  // SQLITE_CORRUPT
  return static_cast<int>(value);
}

std::uint64_t countOf(const Statement& row, int column) {
  return static_cast<std::uint64_t>(row.getColumn(column).getInt64());
}

/// Columns of verdict from `c` on.
Verdict readVerdict(const Statement& row, int c) {
  const auto number = [&](int column) { return row.getColumn(column).getDouble(); };
  return {textOf(row, c),
          textOf(row, c + 1),
          textOf(row, c + 2),
          static_cast<Outcome>(intOf(row, c + 3, 0, static_cast<int>(Outcome::Crash))),
          intOf(row, c + 4),
          number(c + 5),
          number(c + 6),
          number(c + 7),
          textOf(row, c + 8),
          intOf(row, c + 9),
          textOf(row, c + 10),
          textOf(row, c + 11),
          intOf(row, c + 12)};
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
  return {intOf(row, 0, 1), textOf(row, 1), textOf(row, 2), textOf(row, 3), textOf(row, 4),
          textOf(row, 5),   textOf(row, 6), textOf(row, 7), textOf(row, 8), intOf(row, 9) != 0};
}

template <class Item>
std::optional<Item> firstOf(std::vector<Item> items) {
  return items.empty() ? std::optional<Item>() : std::move(items.front());
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
    if (error) throw OutputError(folder_.string() + ": cannot be created: " + error.message());
  } else if (!fs::is_regular_file(file, error)) {
    throw UsageError(file.string() +
                     ": there is no history; `catoptric nightly SUITE` begins one, or give another "
                     "by --history");
  }
  refuseNetwork(folder_);
  // Also a reader rolls back what a killed process left; SQLite opens what is write-protected for
  // reading alone.
  const int flags = SQLite::OPEN_READWRITE | (mode == Mode::Create ? SQLite::OPEN_CREATE : 0);
  try {
    database_ = std::make_unique<Database>(file.string(), flags, kBusyMs);
    database_->exec("PRAGMA foreign_keys = ON");
    SQLite::Transaction look(*database_);  // another process may be making the tables
    const int application = database_->execAndGet("PRAGMA application_id").getInt();
    const int version = database_->execAndGet("PRAGMA user_version").getInt();
    const bool empty = database_->execAndGet("SELECT count(*) FROM sqlite_master").getInt() == 0;
    look.commit();
    if (!empty && application != kApplication)
      throw UsageError(file.string() + ": is not a history of catoptric; choose another file");
    if (mode == Mode::Read && empty)
      throw UsageError(file.string() +
                       ": the history is empty; `catoptric nightly SUITE` measures a first night");
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
                       "); restore it from a backup, or start a new one with --history FILE");
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

template <class Make, class... T>
auto History::rows(const std::string& sql, const Make& make, const T&... values) const {
  try {
    Statement statement(*database_, sql);
    bindAll(statement, values...);
    std::vector<decltype(make(statement))> made;
    while (statement.executeStep()) made.push_back(make(statement));
    return made;
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
  return rows(
      std::string(kNightColumns) + "WHERE ?1 = '' OR n.suite = ?1 ORDER BY n.id DESC LIMIT ?2",
      readNight, suite, limit);
}

std::optional<Night> History::night(int id) const {
  return firstOf(rows(std::string(kNightColumns) + "WHERE n.id = ?", readNight, id));
}

void History::addResult(int night, const CaseFacts& facts) {
  write([&](Database& database) {
    const std::string before =
        "SELECT r.id FROM result r JOIN bench b ON b.id = r.bench WHERE r.night = ? AND b.name = ?";
    for (const char* from : {"sample WHERE result", "frame WHERE result", "result WHERE id"})
      run(database, ("DELETE FROM " + std::string(from) + " IN (" + before + ")").c_str(), night,
          facts.name);
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
  const std::vector<std::string> names = rows(
      "SELECT b.name FROM result r JOIN bench b ON b.id = r.bench WHERE r.night = ?",
      [](const Statement& row) { return textOf(row, 0); }, night);
  return {names.begin(), names.end()};
}

CaseFacts History::result(int night, const std::string& name) const {
  int result = 0;
  const auto readFacts = [&](const Statement& row) {
    CaseFacts facts;
    facts.name = name;
    result = intOf(row, 0);
    facts.bench = textOf(row, 1);
    facts.description = textOf(row, 2);
    facts.failure = textOf(row, 3);
    const config::Value failures = config::parseText(textOf(row, 4), "failures");
    for (const std::string& key : failures.keys())
      facts.baselineFailures[key] = failures.get(key).asString();
    facts.memory = parseCounters(textOf(row, 5));
    facts.command = textOf(row, 6);
    facts.truth = textOf(row, 7);
    return facts;
  };
  std::optional<CaseFacts> facts =
      firstOf(rows("SELECT r.id, b.print, b.description, r.failure, r.baseline_failures, r.memory, "
                   "r.command, r.truth FROM result r JOIN bench b ON b.id = r.bench "
                   "WHERE r.night = ? AND b.name = ?",
                   readFacts, night, name));
  if (!facts) throw UsageError("night " + std::to_string(night) + " has no case " + name);
  facts->timings = rows(
      "SELECT s.role, s.attempt, b.fingerprint, s.times FROM sample s "
      "JOIN build b ON b.id = s.build WHERE s.result = ? ORDER BY s.id",
      [](const Statement& row) {
        return Timing{textOf(row, 0), intOf(row, 1), textOf(row, 2), parseTimes(textOf(row, 3))};
      },
      result);
  const auto frames = rows(
      "SELECT frame, pixels, counters, steps, file, bytes, not_finite FROM frame "
      "WHERE result = ?",
      [](const Statement& row) {
        return std::pair(intOf(row, 0), FrameFacts{textOf(row, 1), parseCounters(textOf(row, 2)),
                                                   parseSteps(textOf(row, 3)), textOf(row, 4),
                                                   countOf(row, 5), countOf(row, 6)});
      },
      result);
  facts->frames = {frames.begin(), frames.end()};
  return *facts;
}

std::optional<std::pair<std::string, std::string>> History::bench(int night,
                                                                  const std::string& name) const {
  return firstOf(rows(
      "SELECT b.print, b.description FROM result r JOIN bench b ON b.id = r.bench "
      "WHERE r.night = ? AND b.name = ?",
      [](const Statement& row) { return std::pair(textOf(row, 0), textOf(row, 1)); }, night, name));
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
  return rows(
      "SELECT " VERDICT_COLUMNS " FROM verdict v WHERE v.night = ? ORDER BY v.id",
      [](const Statement& row) { return readVerdict(row, 0); }, night);
}

std::vector<History::Past> History::past(const std::string& name, const std::string& kind,
                                         const std::string& machine, int night, int limit) const {
  return rows(
      "SELECT n.id, n.started, b.fingerprint, coalesce((SELECT be.print FROM result r JOIN bench "
      "be ON be.id = r.bench WHERE r.night = n.id AND be.name = v.name), ''), " VERDICT_COLUMNS
      " FROM verdict v JOIN night n ON n.id = v.night JOIN build b ON b.id = n.build JOIN "
      "machine m ON m.id = n.machine WHERE v.name = ? AND v.kind = ? AND m.name = ? AND n.id < ? "
      "ORDER BY n.id DESC, v.frame LIMIT ?",
      [](const Statement& row) {
        return Past{intOf(row, 0), textOf(row, 1), textOf(row, 2), textOf(row, 3),
                    readVerdict(row, 4)};
      },
      name, kind, machine, night, limit);
}

std::optional<Baseline> History::baseline(const std::string& name, const std::string& bench,
                                          const std::string& machine,
                                          const std::string& role) const {
  return firstOf(rows(
      "SELECT bu.fingerprint, l.night FROM baseline l JOIN bench b ON b.id = l.bench "
      "JOIN machine m ON m.id = l.machine JOIN build bu ON bu.id = l.build LEFT JOIN "
      "acknowledgement a ON a.id = l.acknowledgement WHERE b.name = ? AND b.print = ? "
      "AND m.name = ? AND l.role = ? AND a.undone IS NULL ORDER BY l.id DESC LIMIT 1",
      [&](const Statement& row) {
        return Baseline{role, textOf(row, 0), intOf(row, 1)};
      },
      name, bench, machine, role));
}

std::map<int, Reference> History::references(const std::string& name,
                                             const std::string& bench) const {
  std::map<int, Reference> all;
  for (Reference& one : rows(
           "SELECT f.frame, f.pixels, f.object, f.counters, f.bytes, f.night FROM reference "
           "f JOIN bench b ON b.id = f.bench JOIN acknowledgement a ON a.id = "
           "f.acknowledgement WHERE b.name = ? AND b.print = ? AND a.undone IS NULL "
           "ORDER BY f.id",
           [](const Statement& row) {
             return Reference{intOf(row, 0),   textOf(row, 1),
                              textOf(row, 2),  parseCounters(textOf(row, 3)),
                              countOf(row, 4), intOf(row, 5)};
           },
           name, bench))
    all[one.frame] = std::move(one);
  return all;
}

std::optional<std::pair<std::string, std::string>> History::acceptedBench(
    const std::string& name) const {
  return firstOf(rows(
      "SELECT b.print, b.description FROM reference f JOIN bench b ON b.id = f.bench JOIN "
      "acknowledgement a ON a.id = f.acknowledgement WHERE b.name = ? AND a.undone IS NULL "
      "ORDER BY f.id DESC LIMIT 1",
      [](const Statement& row) { return std::pair(textOf(row, 0), textOf(row, 1)); }, name));
}

std::set<std::string> History::buildsInUse() const {
  const std::vector<std::string> builds = rows(
      "SELECT DISTINCT bu.fingerprint FROM build bu WHERE bu.id IN (SELECT l.build "
      "FROM baseline l WHERE l.id IN (SELECT max(k.id) FROM baseline k LEFT JOIN "
      "acknowledgement a ON a.id = k.acknowledgement WHERE a.undone IS NULL GROUP BY "
      "k.bench, k.machine, k.role)) OR bu.id IN (SELECT build FROM night ORDER BY id "
      "DESC LIMIT 10)",
      [](const Statement& row) { return textOf(row, 0); });
  return {builds.begin(), builds.end()};
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
  return rows(
      "SELECT id, at, who, what, reason, coalesce(undone, '') FROM acknowledgement "
      "ORDER BY id DESC",
      [](const Statement& row) {
        return Acknowledgement{intOf(row, 0),  textOf(row, 1), textOf(row, 2),
                               textOf(row, 3), textOf(row, 4), textOf(row, 5)};
      });
}

void History::undo(int acknowledgement, const std::string& at) {
  write([&](Database& database) {
    Statement change(database,
                     "UPDATE acknowledgement SET undone = ? WHERE id = ? AND undone IS NULL");
    change.bind(1, at);
    change.bind(2, acknowledgement);
    if (change.exec() == 0)
      throw UsageError("there is no acceptance " + std::to_string(acknowledgement) +
                       " to withdraw; `catoptric nightly log` lists them");
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
