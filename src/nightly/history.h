// The history of nights in an SQLite file. The folder of the file also stores the accepted frames
// and the programs that serve as baselines for times.
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

/// The number of nights that keep every measured time. Older nights keep the medians only. Our
/// choice.
inline constexpr int kRawNights = 60;

class History {
 public:
  enum class Mode { Create, Write, Read };
  /// Opens `file`. Throws OutputError if it cannot be created or written. Throws UsageError if it
  /// does not exist, is no history, is newer than this program, is damaged, or lies on a network
  /// file system.
  History(const std::filesystem::path& file, Mode mode);
  ~History();
  History(const History&) = delete;
  History& operator=(const History&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path nightFolder(int night) const {
    return folder_ / "nights" / std::to_string(night);
  }

  int beginNight(const Night& night);
  /// The nights of a suite, newest first; an empty name: of all suites.
  std::vector<Night> nights(const std::string& suite, int limit) const;
  std::optional<Night> night(int id) const;

  /// Stores the measurements of a case, completely or not at all. Replaces what the night has of
  /// it.
  void addResult(int night, const CaseFacts& facts);
  std::set<std::string> measured(int night) const;
  CaseFacts result(int night, const std::string& name) const;
  /// The fingerprint and description of what a case measured in a night; nullopt: the case did not
  /// exist.
  std::optional<std::pair<std::string, std::string>> bench(int night,
                                                           const std::string& name) const;

  /// Writes all verdicts and the baselines that follow from them, and marks the night as finished.
  void judge(int night, const std::vector<Verdict>& verdicts,
             const std::vector<std::pair<std::string, Baseline>>& baselines,
             const std::string& finished);
  /// Deletes what judging wrote. The night is then measured but not judged.
  void forget(int night);
  std::vector<Verdict> verdicts(int night) const;
  /// An earlier verdict of one kind on one case on one machine, with its build. Lists are newest
  /// first and contain nights before `night`.
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
  /// The fingerprint and description of what a case measured when its frames were last accepted;
  /// nullopt: they never were.
  std::optional<std::pair<std::string, std::string>> acceptedBench(const std::string& name) const;
  /// The programs that are still referred to.
  std::set<std::string> buildsInUse() const;

  /// What one acknowledgement accepts; applied completely or not at all.
  struct Acceptance {
    std::string name;  ///< name of the case
    std::string bench;
    std::vector<Reference> references;
    std::vector<Baseline> baselines;
    std::vector<std::string> kinds;  ///< kinds of the verdicts that it accepts
    int frame = 0;                   ///< 0: all frames
  };
  int accept(const Acknowledgement& acknowledgement, int night,
             const std::vector<Acceptance>& accepted);
  std::vector<Acknowledgement> acknowledgements() const;
  /// Undoes an acknowledgement. Throws UsageError if it does not exist or was undone before.
  void undo(int acknowledgement, const std::string& at);

  /// Replaces the samples of all nights except the newest kRawNights by their medians.
  void thinSamples();

 private:
  void write(const std::function<void(SQLite::Database&)>& change);
  /// Returns make(row) for each row of the query with these values.
  template <class Make, class... T>
  auto rows(const std::string& sql, const Make& make, const T&... values) const;
  int idOf(SQLite::Database& database, const char* table, const std::string& name);

  std::filesystem::path file_;
  std::filesystem::path folder_;
  std::unique_ptr<SQLite::Database> database_;
};

/// For example "2026-11-23T01:30:00Z".
std::string utcNow();

/// Times as text: one line per round.
std::string timesText(const study::RoundTimes& times);
study::RoundTimes parseTimes(const std::string& text);

}  // namespace catoptric::nightly
