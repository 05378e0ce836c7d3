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

/// A table that "each" makes of the suite's table with this number.
Value tableOf(const Value& stated, std::size_t number, const std::string& title,
              const std::vector<std::string>& rows) {
  config::JsonText text;
  text.add("title", title)
      .raw("columns", stated.get("columns").dump())
      .raw("rows", "[" + joined(rows, ",") + "]")
      .add("of_table", static_cast<int>(number));
  if (stated.has("text")) text.add("text", stated.get("text").asString());
  return config::parseText(text.object(), stated.place().text());
}

/// A chart with a curve for each series: its cells over the figure's values.
Chart curvesOf(const Value& figure, const SuiteData& data) {
  Chart chart;
  chart.title = figure.get("title").asString();
  chart.xTitle = figure.get("x").asString();
  chart.yTitle = figure.get("y").asString();
  for (const char axis : {'x', 'y'})
    if (figure.has("log") && figure.get("log").asString().find(axis) != std::string::npos)
      (axis == 'x' ? chart.xLog : chart.yLog) = true;
  const std::vector<Value> places = figure.get("values").asArray();
  for (const std::string& name : figure.get("series").keys()) {
    ChartSeries series{name, {}, true};
    const std::vector<Value> cells = figure.get("series").get(name).asArray();
    for (std::size_t i = 0; i < std::min(cells.size(), places.size()); ++i) {
      ChartPoint point;
      point.x = places[i].asNumber();
      point.y = data.number(cells[i]);
      if (std::isfinite(point.y)) series.points.push_back(point);
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

/// The number of a table's column. Throws UsageError at `asked`.
std::size_t columnOf(const Value& table, const Value& asked) {
  std::vector<std::string> names;
  for (const Value& column : table.get("columns").asArray()) names.push_back(column.asString());
  const auto found = std::ranges::find(names, asked.asString());
  if (found == names.end())
    asked.fail("the table has no column \"" + asked.asString() + "\"" +
               didYouMean(asked.asString(), names) + "; it has " + joined(names, ", "));
  return static_cast<std::size_t>(found - names.begin());
}

/// A chart of a table's rows: a point each, from the columns that `panel` names.
Chart chartOfRows(const Value& table, const Value& figure, const Value& panel,
                  const SuiteData& data) {
  const std::size_t x = columnOf(table, panel.get("x"));
  const std::size_t y = columnOf(table, figure.get("y"));
  const std::size_t mark = columnOf(table, panel.get("mark"));
  Chart chart;
  chart.title = table.get("title").asString();
  chart.xTitle = panel.get("title").asString();
  chart.yTitle = figure.get("y").asString();
  chart.xLog = chart.yLog = chart.showFront = true;
  constexpr std::size_t kGrey = 6;
  chart.series.resize(2);  // the front, and what is not on it
  chart.series[1].colour = kGrey;
  for (const Value& row : table.get("rows").asArray()) {
    const std::vector<Value>& cells = row.asArray();
    ChartPoint point;
    point.x = data.number(cells.at(x));
    point.y = data.number(cells.at(y));
    if (!std::isfinite(point.x) || !std::isfinite(point.y)) continue;
    point.mark = Mark::Unclear;
    point.label = cells.front().asString();
    point.title =
        point.label + ": " + data.cell(cells[x]) + ", " + chart.yTitle + " " + data.cell(cells[y]);
    const std::string text = data.cell(cells.at(mark));
    for (const Mark one : {Mark::Front, Mark::Dominated})
      if (text == markName(one)) point.mark = one;
    chart.series[text == markName(Mark::Front) ? 0 : 1].points.push_back(point);
  }
  return chart;
}

/// A chart for each table that "each" made of the suite's table `of_table`, and for each panel.
SuiteFigure multiplesOf(const Suite& suite, const Value& figure, const SuiteData& data) {
  const std::vector<Value> panels = figure.get("panels").asArray();
  SuiteFigure multiples;
  multiples.columns = static_cast<int>(panels.size());
  for (const Value& table : suite.tables)
    if (table.has("of_table") &&
        table.get("of_table").asInteger() == figure.get("of_table").asInteger())
      for (const Value& panel : panels)
        multiples.charts.push_back(chartOfRows(table, figure, panel, data));
  if (multiples.charts.empty())
    figure.get("of_table").fail("must be the number of a table with \"each\", from 1");
  return multiples;
}

}  // namespace

std::vector<Value> expandedTables(const std::vector<Value>& tables,
                                  const std::vector<SuiteRun>& runs) {
  std::vector<Value> expanded;
  for (std::size_t number = 1; number <= tables.size(); ++number) {
    const Value& table = tables[number - 1];
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
        expanded.push_back(
            tableOf(table, number, filled(table.get("title").asString(), words), rows));
    }
    if (!byMethod) expanded.push_back(tableOf(table, number, table.get("title").asString(), rows));
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

std::string SuiteFigure::svg() const {
  return columns > 1 ? toSvg(charts, 450, 250, columns) : toSvg(charts);
}

std::vector<SuiteFigure> suiteFigures(const Suite& suite, const SuiteData& data) {
  std::vector<SuiteFigure> figures;
  for (const Value& value : suite.figures) {
    figures.push_back(value.has("of_table") ? multiplesOf(suite, value, data)
                                            : SuiteFigure{{curvesOf(value, data)}});
    if (value.has("file")) figures.back().file = value.get("file").asString();
  }
  return figures;
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
