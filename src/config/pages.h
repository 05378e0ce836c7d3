// Text of the reference pages that the program prints.
#pragma once

#include <string>
#include <vector>

#include "config/json.h"

namespace catoptric::config {

/// What a field may be, and its help: "(`8`; 1 to 64): rays per sample".
std::string fieldText(const Field& field);
/// For example "- `rays` (`8`; 1 to 64): rays per sample" (default, allowed values).
std::string markdownLine(const Field& field);
/// A section with one line per field, and sections for the objects that are nested in fields.
std::string markdownList(const Schema& schema);

/// Collects lines that describe several methods. A line that several methods share is printed once.
class SharedLines {
 public:
  /// Adds `line`, which describes an item of the method `owner` and ends with a newline.
  void add(const std::string& owner, const std::string& line);
  /// The lines that several methods share, under headings "**method, method**".
  std::string shared() const;
  /// The lines that only `owner` has, then, if it has shared lines, a link to them at `place`.
  std::string of(const std::string& owner, const std::string& place) const;

 private:
  struct Line {
    std::string text;
    std::vector<std::string> owners;
  };
  std::vector<Line> lines_;
};

}  // namespace catoptric::config
