// A page of HTML that stands alone: text, tables and curves, light and dark, without a script.
#pragma once

#include <string>

#include "report/table.h"

namespace catoptric::study {

class Page {
 public:
  explicit Page(const std::string& title);
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void table(const report::Table& table);
  /// SVG text as it is.
  void svg(const std::string& text);
  /// Text that is folded away.
  void details(const std::string& title, const std::string& text);
  std::string text() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace catoptric::study
