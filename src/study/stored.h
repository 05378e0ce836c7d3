// Stored values of a suite's cells, in a file beside the page. A cell is measured again only if the
// settings that it refers to have changed.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "study/suite.h"

namespace catoptric::study {

/// Computes a fingerprint of each cell: of the runs and methods that the cell uses at one level of
/// effort. It covers configs, settings and frames as they are written, not as the program
/// interprets them. Each config is read once.
class StatedPrints {
 public:
  StatedPrints(const Suite& suite, std::string effort)
      : suite_(suite), effort_(std::move(effort)) {}

  /// The fingerprint of a cell. Empty: the cell refers to something that does not exist.
  std::string of(const std::string& cell);

 private:
  /// What a run's method adds to a fingerprint; empty: there is no such run or method.
  const std::vector<std::string>& stated(const std::string& run, const std::string& method);

  const Suite& suite_;
  std::string effort_;
  std::map<std::filesystem::path, config::Value> configs_;
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> stated_;
};

/// The file of stored values. A missing file yields no values.
class StoredValues {
 public:
  explicit StoredValues(const std::filesystem::path& file);

  /// The stored values that are valid for the suite's present settings.
  std::map<std::string, SuiteData::Stored> fresh(const Suite& suite,
                                                 const std::string& effort) const;
  /// Stores the present values of all cells in `data`, and drops values that no cell uses. `by`:
  /// text that names the command and the processor with which the new values were measured.
  void keep(const Suite& suite, const SuiteData& data, const std::string& effort,
            const std::string& by);
  void write() const;
  /// The fingerprint of all that a picture was made from; empty: not known.
  std::string& picture(const std::string& file) { return pictures_[file]; }

 private:
  struct Entry {
    SuiteData::Stored value;
    std::string of;  ///< fingerprint by StatedPrints
    std::string by;
  };
  std::filesystem::path file_;
  std::map<std::string, Entry> entries_;
  std::map<std::string, std::string> pictures_;
};

/// The methods that cells without a valid value need, by run.
std::map<std::string, std::set<std::string>> neededMethods(
    const Suite& suite, const std::map<std::string, SuiteData::Stored>& fresh);

}  // namespace catoptric::study
