// Tables of text cells, printed as aligned text for a terminal, Markdown, LaTeX, CSV or JSON.
#pragma once

#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace catoptric::report {

struct Column {
  std::string title;
  bool number = false;  ///< right-aligned
  bool detail = false;  ///< may be left out of a narrow window
};

struct Table {
  std::string title;  ///< empty: no title
  std::vector<Column> columns;
  /// Cells. A row without cells is a horizontal rule. Missing cells at the end of a row are empty.
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> notes;  ///< lines below the table
};

/// Aligned text: two spaces between columns, a rule below the titles, no trailing spaces. Widths
/// are counted in code points. Where a line would have more than `most` columns of characters, the
/// table's last details are left out, and named below it.
std::string toText(const Table& table, std::size_t most = std::numeric_limits<std::size_t>::max());
/// GitHub's Markdown, without rules; "|" is escaped.
std::string toMarkdown(const Table& table);

/// A LaTeX tabular (booktabs) with the notes below it.
std::string toTex(const Table& table);
/// Writes NAME.md and NAME.tex to `folder`.
void writeTables(const std::filesystem::path& folder, const std::string& name,
                 std::span<const Table> tables);
/// The cells alone as CSV. [RFC 4180]
std::string toCsv(const Table& table);

/// A JSON object of title, columns, rows of cells (without rules) and notes. A cell that consists
/// of a number becomes a number, any other cell a string.
std::string toJson(const Table& table);

/// `value` with `decimals` digits after the decimal point, in the C locale.
std::string fixedText(double value, int decimals);
/// `value` with enough digits to be read back as the same double.
std::string exactText(double value);

}  // namespace catoptric::report
