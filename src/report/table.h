// Tables of text cells, as aligned text for a terminal and as Markdown.
#pragma once

#include <string>
#include <vector>

namespace catoptric::report {

struct Column {
  std::string title;
  bool number = false;  ///< aligned to the right
};

struct Table {
  std::string title;  ///< empty: none
  std::vector<Column> columns;
  /// Cells; a row without cells is a rule. Short rows are filled with empty cells.
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> notes;  ///< lines below
};

/// Columns two spaces apart, a rule below the titles; lines carry no trailing blanks. Widths count
/// code points.
std::string toText(const Table& table);
/// GitHub's Markdown; rules are left out, "|" is escaped.
std::string toMarkdown(const Table& table);

/// A LaTeX tabular (booktabs), notes below it.
std::string toTex(const Table& table);
/// The cells alone. [RFC 4180]
std::string toCsv(const Table& table);

/// An object of title, columns, rows of cells (rules are left out) and notes. A cell
/// that is a number as a whole is one, every other one a string.
std::string toJson(const Table& table);

/// `value` with `decimals` digits after the point, in the C locale.
std::string fixedText(double value, int decimals);
/// With enough digits to come back to the same double.
std::string exactText(double value);

}  // namespace catoptric::report
