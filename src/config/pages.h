// Text of the pages that the program prints about itself.
#pragma once

#include <string>
#include <vector>

#include "config/json.h"

namespace catoptric::config {

/// "- `rays` (`8`; 1 to 64): rays per sample": first the default, then what else is allowed.
std::string markdownLine(const Field& field);
/// A section with a line for each field, and sections of the objects that fields hold.
std::string markdownList(const Schema& schema);

/// Lines about several things; a line that is the same for several of them stands once.
class SharedLines {
 public:
  /// `line` describes `name` of `owner`; it ends with a newline.
  void add(const std::string& owner, const std::string& name, const std::string& line);
  /// The lines of several owners, below "**owner, owner**".
  std::string shared() const;
  /// The lines of this owner alone; then the names of those in shared(), linked to `place`.
  std::string of(const std::string& owner, const std::string& place) const;

 private:
  struct Line {
    std::string text;
    std::string name;
    std::vector<std::string> owners;
  };
  std::vector<Line> lines_;
};

}  // namespace catoptric::config
