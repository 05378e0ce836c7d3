// Pages of HTML.
#pragma once

#include <functional>
#include <string>

#include "report/table.h"

namespace catoptric::report {

/// Text with &, <, > and quotes written as XML and HTML want them.
std::string xmlText(const std::string& text);

/// A whole page; `head` (its style) and `body` are HTML.
std::string htmlPage(const std::string& title, const std::string& head, const std::string& body);

/// Columns and rows of a table; `html` makes HTML of a cell's text. Titles that are all empty are
/// left out; a row whose last cell is "front" has that class.
std::string htmlTable(const Table& table,
                      const std::function<std::string(const std::string&)>& html);

/// A page that stands alone: text, tables and curves, light and dark, without a script.
class HtmlPage {
 public:
  explicit HtmlPage(const std::string& title);
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void table(const Table& table);
  /// SVG text as it is.
  void svg(const std::string& text);
  /// Text that is folded away.
  void details(const std::string& title, const std::string& text);
  std::string text() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace catoptric::report
