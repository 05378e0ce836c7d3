// Values of a suite's cells that were measured before, kept in a file beside the page: a cell is
// measured again only where the settings that it names have changed.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "study/suite.h"

namespace catoptric::study {

/// What a suite states of a cell's runs and methods for an effort: configs, settings, frames, as
/// they are written, not what the program makes of them. Empty: the cell names what is not there.
std::string statedPrint(const Suite& suite, const std::string& cell, const std::string& effort);

/// The file of stored values. Reading one that is not there gives none.
class StoredValues {
 public:
  explicit StoredValues(const std::filesystem::path& file);

  /// The values that hold for what the suite states now.
  std::map<std::string, SuiteData::Stored> fresh(const Suite& suite,
                                                 const std::string& effort) const;
  /// Keeps what the cells of `data` have now, and nothing that no cell asks for; `by` is what
  /// measured those that were not known.
  void keep(const Suite& suite, const SuiteData& data, const std::string& effort,
            const std::string& by);
  void write() const;
  /// The fingerprint of what a picture was made of; empty: it is not known.
  std::string& picture(const std::string& file) { return pictures_[file]; }

 private:
  struct Entry {
    SuiteData::Stored value;
    std::string of;  ///< statedPrint()
    std::string by;
  };
  std::filesystem::path file_;
  std::map<std::string, Entry> entries_;
  std::map<std::string, std::string> pictures_;
};

/// Methods that cells without a fresh value need, by run.
std::map<std::string, std::set<std::string>> neededMethods(
    const Suite& suite, const std::map<std::string, SuiteData::Stored>& fresh);

}  // namespace catoptric::study
