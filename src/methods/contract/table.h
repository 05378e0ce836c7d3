// Tables to which a method adds rows in each frame, such as its clusters, impostors or key frames.
// Each is written to a file NAME.csv in the run's folder, with a column `frame` before the table's
// own columns.
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
  std::string name;  ///< snake_case, with the unit if there is one
  ColumnType type = ColumnType::Integer;
  std::string meaning;
};

/// The description of a table in a method's entry.
struct TableInfo {
  std::string name;     ///< snake_case; also the name of the file
  std::string meaning;  ///< what a row is
  std::vector<Column> columns;
};

/// The alternatives are in the order of ColumnType.
using Cell = std::variant<std::int64_t, double, std::string>;
using Row = std::vector<Cell>;

/// The rows of one frame.
class Table {
 public:
  explicit Table(const TableInfo& info) : name_(info.name), columns_(info.columns) {}

  /// Takes one cell per column, of the column's type; flags are the integers 0 and 1. Throws Error
  /// (Internal) if the cells do not match the columns.
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

/// Returns "integer", "real" or "text".
const char* columnTypeName(ColumnType type);
/// The cell as written to a CSV file: reals with six digits, text quoted if needed.
std::string cellText(const Cell& cell);

}  // namespace catoptric::methods
