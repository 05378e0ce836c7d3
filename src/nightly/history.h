// The history of nights in a file of SQLite, and beside it the frames that people accepted and the
// programs that times are compared with.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>

#include "nightly/facts.h"

namespace SQLite {
class Database;
}

namespace catoptric::nightly {

/// How many nights keep every sample; of older ones the medians stay. Ours.
inline constexpr int kRawNights = 60;

class History {
 public:
  enum class Mode { Create, Write, Read };
  /// Opens `file`. Throws OutputError when it cannot be made or written, UsageError when it is not
  /// there, not ours, newer than this program, damaged, or on a network file system.
  History(const std::filesystem::path& file, Mode mode);
  ~History();
  History(const History&) = delete;
  History& operator=(const History&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path nightFolder(int night) const {
    return folder_ / "nights" / std::to_string(night);
  }

  int beginNight(const Night& night);
  /// Nights of a suite, newest first; empty: of all suites.
  std::vector<Night> nights(const std::string& suite, int limit) const;
  std::optional<Night> night(int id) const;

  /// Keeps what was measured, all of it or nothing.
  void addResult(int night, const CaseFacts& facts);
  std::set<std::string> measured(int night) const;
  CaseFacts result(int night, const std::string& name) const;
  /// The bench of a case in a night: fingerprint and description; none: it was not there.
  std::optional<std::pair<std::string, std::string>> bench(int night,
                                                           const std::string& name) const;

  /// Writes all verdicts and the baselines that follow from them, and finishes the night.
  void judge(int night, const std::vector<Verdict>& verdicts,
             const std::vector<std::pair<std::string, Baseline>>& baselines,
             const std::string& finished);
  /// Takes back what judging wrote: the night is as it was measured.
  void forget(int night);
  std::vector<Verdict> verdicts(int night) const;
  /// Of one case and kind on one machine in nights before `night`, newest first, with the build.
  struct Past {
    int night = 0;
    std::string started;
    std::string build;
    std::string bench;
    Verdict verdict;
  };
  std::vector<Past> past(const std::string& name, const std::string& kind,
                         const std::string& machine, int night, int limit = 400) const;

  std::optional<Baseline> baseline(const std::string& name, const std::string& bench,
                                   const std::string& machine, const std::string& role) const;
  std::map<int, Reference> references(const std::string& name, const std::string& bench) const;
  /// Programs that something still refers to.
  std::set<std::string> buildsInUse() const;

  /// One acknowledgement with what it accepts, all or nothing.
  struct Acceptance {
    std::string name;  ///< of the case
    std::string bench;
    std::vector<Reference> references;
    std::vector<Baseline> baselines;
    std::vector<std::string> kinds;  ///< of verdicts that it answers
    int frame = 0;                   ///< 0: all
  };
  int accept(const Acknowledgement& acknowledgement, int night,
             const std::vector<Acceptance>& accepted);
  std::vector<Acknowledgement> acknowledgements() const;
  /// Takes the acknowledgement back. Throws UsageError when there is none or it was undone.
  void undo(int acknowledgement, const std::string& at);

  /// Replaces samples of nights but the newest kRawNights by their medians.
  void thinSamples();

 private:
  void write(const std::function<void(SQLite::Database&)>& change);
  /// What `make` makes of each row of the query with these values.
  template <class Make, class... T>
  auto rows(const std::string& sql, const Make& make, const T&... values) const;
  int idOf(SQLite::Database& database, const char* table, const std::string& name);

  std::filesystem::path file_;
  std::filesystem::path folder_;
  std::unique_ptr<SQLite::Database> database_;
};

/// "2026-11-23T01:30:00Z".
std::string utcNow();

/// Times as text: a line for each round.
std::string timesText(const study::RoundTimes& times);
study::RoundTimes parseTimes(const std::string& text);

}  // namespace catoptric::nightly
