// Tables that a method fills frame by frame: clusters, impostors, key frames. The run's folder gets
// a file NAME.csv of each: the column `frame`, then the table's own.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace catoptric::methods {

enum class ColumnType : std::uint8_t { Integer, Real, Text };

struct Column {
  std::string name;  ///< snake_case, with its unit where it has one
  ColumnType type = ColumnType::Integer;
  std::string meaning;
};

/// What a method's entry says of a table.
struct TableInfo {
  std::string name;     ///< snake_case: that of its file
  std::string meaning;  ///< what a row is
  std::vector<Column> columns;
};

/// Alternatives in the order of ColumnType.
using Cell = std::variant<std::int64_t, double, std::string>;
using Row = std::vector<Cell>;

/// The rows of one frame.
class Table {
 public:
  explicit Table(const TableInfo& info) : name_(info.name), columns_(info.columns) {}

  /// One cell per column, of its type; flags are the integers 0 and 1. Throws Error (Internal) when
  /// they do not fit.
  template <class... Cells>
  void add(const Cells&... cells) {
    addRow({cell(cells)...});
  }
  void addRow(Row row);

  const std::string& name() const { return name_; }
  void rename(std::string name) { name_ = std::move(name); }
  const std::vector<Column>& columns() const { return columns_; }
  const std::vector<Row>& rows() const { return rows_; }

 private:
  template <std::integral Number>
  static Cell cell(Number number) {
    return static_cast<std::int64_t>(number);
  }
  template <std::floating_point Number>
  static Cell cell(Number number) {
    return static_cast<double>(number);
  }
  static Cell cell(const std::string& text) { return text; }

  std::string name_;
  std::vector<Column> columns_;
  std::vector<Row> rows_;
};

/// "integer", "real", "text".
const char* columnTypeName(ColumnType type);
/// As it stands in a CSV file: reals with six digits, text quoted where it must be.
std::string cellText(const Cell& cell);

}  // namespace catoptric::methods
