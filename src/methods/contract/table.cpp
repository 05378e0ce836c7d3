#include "methods/contract/table.h"

#include <fmt/core.h>

#include <utility>

#include "core/error.h"
#include "core/text.h"

namespace catoptric::methods {

void Table::addRow(Row row) {
  bool fits = row.size() == columns_.size();
  for (std::size_t i = 0; fits && i < row.size(); ++i)
    fits = row[i].index() == static_cast<std::size_t>(columns_[i].type);
  if (!fits)
    throw Error(ExitCode::Internal,
                "a row of the table \"" + name_ + "\" does not fit its columns");
  rows_.push_back(std::move(row));
}

const char* columnTypeName(ColumnType type) {
  switch (type) {
    case ColumnType::Integer:
      return "integer";
    case ColumnType::Real:
      return "real";
    case ColumnType::Text:
      return "text";
  }
  return "";
}

std::string cellText(const Cell& cell) {
  if (const auto* integer = std::get_if<std::int64_t>(&cell)) return std::to_string(*integer);
  if (const auto* real = std::get_if<double>(&cell)) return fmt::format("{:.6g}", *real);
  return csvCell(std::get<std::string>(cell));
}

}  // namespace catoptric::methods
