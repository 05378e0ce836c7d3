// A suite's tables and curves.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "config/json_text.h"
#include "core/error.h"
#include "core/text.h"
#include "run/config/run_config.h"
#include "study/suite.h"

namespace catoptric::study {
namespace {

using config::Value;

/// `text` with the words RUN, TITLE and METHOD replaced.
std::string filled(std::string text, const std::map<std::string, std::string>& words) {
  for (const auto& [word, value] : words)
    for (std::size_t at = text.find(word); at != std::string::npos;
         at = text.find(word, at + value.size()))
      text.replace(at, word.size(), value);
  return text;
}

/// The methods that a run measures: its own, or all of its config.
std::vector<std::string> methodsOf(const SuiteRun& run) {
  if (!run.methods.empty()) return run.methods;
  std::vector<std::string> names;
  const Value methods = config::parseFile(run.config).get("methods");
  for (const Value& method : methods.asArray()) names.push_back(run::entryName(method));
  return names;
}

Value tableOf(const Value& stated, const std::string& title, const std::vector<std::string>& rows) {
  config::JsonText text;
  text.add("title", title)
      .raw("columns", stated.get("columns").dump())
      .raw("rows", "[" + joined(rows, ",") + "]");
  if (stated.has("text")) text.add("text", stated.get("text").asString());
  return config::parseText(text.object(), stated.place().text());
}

}  // namespace

std::vector<Value> expandedTables(const std::vector<Value>& tables,
                                  const std::vector<SuiteRun>& runs) {
  std::vector<Value> expanded;
  for (const Value& table : tables) {
    const Value each = table.get("each");
    if (each.isNull()) {
      expanded.push_back(table);
      continue;
    }
    const std::string row = table.get("row").dump();
    const bool byMethod = row.find("METHOD") != std::string::npos;
    std::vector<std::string> rows;
    for (const std::string& name : each.keys()) {
      const auto run = std::ranges::find(runs, name, &SuiteRun::name);
      if (run == runs.end()) each.get(name).fail("\"" + name + "\" is not a run of this suite");
      std::map<std::string, std::string> words{{"RUN", name}, {"TITLE", each.get(name).asString()}};
      if (byMethod) rows.clear();
      for (const std::string& method :
           byMethod ? methodsOf(*run) : std::vector<std::string>{run->against}) {
        words["METHOD"] = method;
        rows.push_back(filled(row, words));
      }
      if (byMethod)
        expanded.push_back(tableOf(table, filled(table.get("title").asString(), words), rows));
    }
    if (!byMethod) expanded.push_back(tableOf(table, table.get("title").asString(), rows));
  }
  return expanded;
}

std::vector<report::Table> suiteTables(const Suite& suite, const SuiteData& data) {
  std::vector<report::Table> tables;
  for (const Value& value : suite.tables) {
    report::Table table;
    table.title = value.get("title").asString();
    for (const Value& title : value.get("columns").asArray())
      table.columns.push_back({title.asString(), !table.columns.empty()});
    for (const Value& row : value.get("rows").asArray()) {
      std::vector<std::string> cells;
      for (const Value& cell : row.asArray()) cells.push_back(data.cell(cell));
      if (cells.size() != table.columns.size())
        row.fail("this row has " + std::to_string(cells.size()) + " cells, the table has " +
                 std::to_string(table.columns.size()) + " columns");
      table.rows.push_back(std::move(cells));
    }
    // A column of words is no column of numbers
    for (std::size_t c = 1; c < table.columns.size() && !table.rows.empty(); ++c)
      table.columns[c].number = std::ranges::any_of(table.rows, [&](const auto& row) {
        return row[c].empty() || row[c].find_first_of("0123456789") == 0;
      });
    if (value.has("text")) table.notes.push_back(value.get("text").asString());
    tables.push_back(std::move(table));
  }
  return tables;
}

std::vector<SuiteChart> suiteCharts(const Suite& suite, const SuiteData& data) {
  std::vector<SuiteChart> charts;
  for (const Value& value : suite.figures) {
    Chart chart;
    chart.title = value.get("title").asString();
    chart.xTitle = value.get("x").asString();
    chart.yTitle = value.get("y").asString();
    for (const char axis : {'x', 'y'})
      if (value.has("log") && value.get("log").asString().find(axis) != std::string::npos)
        (axis == 'x' ? chart.xLog : chart.yLog) = true;
    const std::vector<Value> places = value.get("values").asArray();
    for (const std::string& name : value.get("series").keys()) {
      ChartSeries series{name, {}, true};
      const std::vector<Value> cells = value.get("series").get(name).asArray();
      for (std::size_t i = 0; i < std::min(cells.size(), places.size()); ++i) {
        ChartPoint point;
        point.x = places[i].asNumber();
        point.y = data.number(cells[i]);
        if (std::isfinite(point.y)) series.points.push_back(point);
      }
      chart.series.push_back(std::move(series));
    }
    charts.push_back(
        {std::move(chart), value.has("file") ? value.get("file").asString() : std::string()});
  }
  return charts;
}

std::string withTables(const std::string& page, const std::vector<report::Table>& tables,
                       const std::string& name) {
  const std::string before = "<!-- table ";
  const std::string after = "<!-- end -->";
  std::string text;
  std::size_t at = 0;
  for (std::size_t mark = page.find(before); mark != std::string::npos;
       mark = page.find(before, at)) {
    const std::size_t line = page.find('\n', mark);
    const std::size_t end = page.find(after, mark);
    const auto number = static_cast<std::size_t>(std::atoi(page.c_str() + mark + before.size()));
    if (end == std::string::npos || line > end)
      throw UsageError(name + ": \"" + page.substr(mark, line - mark) + "\" has no line \"" +
                       after + "\" below it");
    if (number == 0 || number > tables.size())
      throw UsageError(name + ": \"" + page.substr(mark, line - mark) + "\": the suite has " +
                       std::to_string(tables.size()) + " tables");
    report::Table table = tables[number - 1];
    table.title.clear();  // the page has its own heading
    text += page.substr(at, line + 1 - at) + "\n" + report::toMarkdown(table) + "\n";
    at = end;
  }
  return text + page.substr(at);
}

}  // namespace catoptric::study
