// HTML pages.
#pragma once

#include <functional>
#include <string>

#include "report/table.h"

namespace catoptric::report {

/// Text with &, <, > and quotes escaped for XML and HTML.
std::string xmlText(const std::string& text);

/// A complete page. `head` (its style) and `body` are HTML.
std::string htmlPage(const std::string& title, const std::string& head, const std::string& body);

/// The columns and rows of a table. `html` converts a cell's text to HTML. The header row is left
/// out if all titles are empty. A row whose last cell is "front" gets the class "front".
std::string htmlTable(const Table& table,
                      const std::function<std::string(const std::string&)>& html);

/// A self-contained page: text, tables and curves, for light and dark displays, without a script.
class HtmlPage {
 public:
  explicit HtmlPage(const std::string& title);
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void table(const Table& table);
  /// Adds SVG text unchanged.
  void svg(const std::string& text);
  /// Adds text that is initially folded away.
  void details(const std::string& title, const std::string& text);
  std::string text() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace catoptric::report
