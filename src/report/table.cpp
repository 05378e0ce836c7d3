#include "report/table.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <string_view>

#include "config/json_text.h"
#include "core/file.h"
#include "core/text.h"

namespace catoptric::report {
namespace {

/// Code points of UTF-8 text.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string cellOf(const std::vector<std::string>& row, std::size_t column) {
  return column < row.size() ? row[column] : "";
}

void trimRight(std::string& text) {
  text.erase(text.find_last_not_of(' ') + 1);
}

}  // namespace

std::string toText(const Table& table, std::size_t most) {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    widths.push_back(width(table.columns[c].title));
    for (const auto& row : table.rows) widths[c] = std::max(widths[c], width(cellOf(row, c)));
  }
  std::vector<bool> shown(widths.size(), true);
  std::vector<std::string> leftOut;
  std::size_t line = std::accumulate(widths.begin(), widths.end(), 2 * widths.size());
  for (std::size_t c = widths.size(); c-- > 0;) {
    if (line - 2 <= most || !table.columns[c].detail) continue;
    shown[c] = false;
    line -= widths[c] + 2;
    leftOut.insert(leftOut.begin(), table.columns[c].title);
  }
  std::string text = table.title.empty() ? "" : table.title + "\n";
  const auto append = [&](const std::vector<std::string>& cells) {
    std::string row;
    bool first = true;
    for (std::size_t c = 0; c < widths.size(); ++c) {
      if (!shown[c]) continue;
      const std::string cell = cellOf(cells, c);
      const std::string blanks(widths[c] - width(cell), ' ');
      row += (first ? "" : "  ") + (table.columns[c].number ? blanks + cell : cell + blanks);
      first = false;
    }
    trimRight(row);
    text += row + "\n";
  };
  std::vector<std::string> titles;
  std::vector<std::string> rule;
  for (std::size_t c = 0; c < widths.size(); ++c) {
    titles.push_back(table.columns[c].title);
    rule.emplace_back(widths[c], '-');
  }
  if (!table.columns.empty()) {
    append(titles);
    append(rule);
  }
  for (const auto& row : table.rows) append(row.empty() ? rule : row);
  if (!leftOut.empty())
    text += "Left out to fit the window: " + joined(leftOut, ", ") + " (all: | less -S)\n";
  for (const std::string& note : table.notes) text += note + "\n";
  return text;
}

std::string toMarkdown(const Table& table) {
  std::string text = table.title.empty() ? "" : "### " + table.title + "\n\n";
  const auto append = [&](const std::vector<std::string>& cells) {
    text += "|";
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      text += " ";
      for (const char letter : cellOf(cells, c)) {
        if (letter == '|') text += '\\';
        text += letter;
      }
      text += " |";
    }
    text += "\n";
  };
  std::vector<std::string> titles;
  std::string rule = "|";
  for (const Column& column : table.columns) {
    titles.push_back(column.title);
    rule += column.number ? "---:|" : "---|";
  }
  append(titles);
  text += rule + "\n";
  for (const auto& row : table.rows)
    if (!row.empty()) append(row);
  for (const std::string& note : table.notes) text += "\n" + note + "\n";
  return text;
}

namespace {

/// Text with LaTeX's own letters written as text.
std::string texText(const std::string& text) {
  std::string out;
  for (const char letter : text) {
    if (std::string_view("&%$#_{}").find(letter) != std::string_view::npos)
      out += std::string("\\") + letter;
    else if (letter == '\\')
      out += "\\textbackslash{}";
    else if (letter == '~')
      out += "\\textasciitilde{}";
    else if (letter == '^')
      out += "\\textasciicircum{}";
    else
      out += letter;
  }
  return out;
}

}  // namespace

std::string toTex(const Table& table) {
  std::string text = table.title.empty() ? "" : "% " + table.title + "\n";
  std::string columns;
  std::vector<std::string> titles;
  for (const Column& column : table.columns) {
    columns += column.number ? "r" : "l";
    titles.push_back(column.title);
  }
  const auto append = [&](const std::vector<std::string>& cells) {
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      text += (c > 0 ? " & " : "") + texText(cellOf(cells, c));
    text += " \\\\\n";
  };
  text += "\\begin{tabular}{" + columns + "}\n\\toprule\n";
  append(titles);
  text += "\\midrule\n";
  for (const auto& row : table.rows)
    if (row.empty())
      text += "\\midrule\n";
    else
      append(row);
  text += "\\bottomrule\n\\end{tabular}\n";
  for (const std::string& note : table.notes) text += "\\par " + texText(note) + "\n";
  return text;
}

void writeTables(const std::filesystem::path& folder, const std::string& name,
                 std::span<const Table> tables) {
  std::string markdown;
  std::string tex;
  for (const Table& table : tables) {
    markdown += (markdown.empty() ? "" : "\n") + toMarkdown(table);
    tex += (tex.empty() ? "" : "\n") + toTex(table);
  }
  writeFileAtomically(folder / (name + ".md"), std::string_view(markdown));
  writeFileAtomically(folder / (name + ".tex"), std::string_view(tex));
}

std::string toCsv(const Table& table) {
  std::string text;
  const auto append = [&](const auto& cells, const auto& textOf) {
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      text += (c > 0 ? "," : "") + csvCell(textOf(cells, c));
    text += "\n";
  };
  append(table.columns, [](const auto& columns, std::size_t c) { return columns[c].title; });
  for (const auto& row : table.rows)
    if (!row.empty())
      append(row, [](const auto& cells, std::size_t c) { return cellOf(cells, c); });
  return text;
}

std::string toJson(const Table& table) {
  const auto cellText = [&](const std::vector<std::string>& row, std::size_t c) {
    const std::string text = cellOf(row, c);
    double number = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool isNumber =
        error == std::errc() && end == text.data() + text.size() && std::isfinite(number);
    return isNumber ? config::numberText(number) : config::jsonString(text);
  };
  std::vector<std::string> titles;
  for (const Column& column : table.columns) titles.push_back(column.title);
  std::vector<std::string> rows;
  for (const auto& row : table.rows) {
    if (row.empty()) continue;
    std::vector<std::string> cells;
    for (std::size_t c = 0; c < table.columns.size(); ++c) cells.push_back(cellText(row, c));
    rows.push_back("[" + joined(cells, ", ") + "]");
  }
  return config::JsonText()
      .add("title", table.title)
      .add("columns", titles)
      .raw("rows", "[" + joined(rows, ",\n") + "]")
      .add("notes", table.notes)
      .object();
}

std::string fixedText(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

std::string exactText(double value) {
  char buffer[64];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return error == std::errc() ? std::string(buffer, end) : "?";
}

}  // namespace catoptric::report
