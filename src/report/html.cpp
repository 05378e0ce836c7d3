#include "report/html.h"

#include <algorithm>

namespace catoptric::report {

std::string xmlText(const std::string& text) {
  std::string out;
  for (const char letter : text) {
    if (letter == '&')
      out += "&amp;";
    else if (letter == '<')
      out += "&lt;";
    else if (letter == '>')
      out += "&gt;";
    else if (letter == '"')
      out += "&quot;";
    else
      out += letter;
  }
  return out;
}

namespace {

constexpr const char* kStyle = R"(
:root{color-scheme:light dark}
body{font:15px/1.5 system-ui,'DejaVu Sans',sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;
color:#1c1c1c;background:#fff}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}
.wide{overflow-x:auto}
table{border-collapse:collapse;font-size:.85rem;font-variant-numeric:tabular-nums}
th,td{padding:.25rem .7rem;border-bottom:1px solid #ddd;text-align:left;white-space:nowrap}
th{border-bottom:2px solid #999}td.n,th.n{text-align:right}
tr.front td{font-weight:600}
.note{color:#555;font-size:.85rem}
svg{max-width:100%;height:auto}
pre{white-space:pre-wrap;font-size:.8rem}
@media(prefers-color-scheme:dark){body{color:#e8e8e8;background:#16181b}
th,td{border-color:#333}th{border-color:#777}.note{color:#aaa}}
)";

/// Text of a page; what stands between back quotes is code.
std::string htmlText(const std::string& text) {
  std::string html = xmlText(text);
  for (std::size_t open = html.find('`'); open != std::string::npos; open = html.find('`', open)) {
    const std::size_t close = html.find('`', open + 1);
    if (close == std::string::npos) break;
    html.replace(close, 1, "</code>");
    html.replace(open, 1, "<code>");
  }
  return html;
}

}  // namespace

std::string htmlPage(const std::string& title, const std::string& head, const std::string& body) {
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta "
         "name=\"viewport\" content=\"width=device-width\">\n<title>" +
         xmlText(title) + "</title>\n" + head + "</head>\n<body>\n" + body + "</body></html>\n";
}

std::string htmlTable(const Table& table,
                      const std::function<std::string(const std::string&)>& html) {
  std::string text = "<div class=\"wide\"><table>\n";
  const auto addRow = [&](const std::string& tag, const auto& cellOf) {
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      text += "<" + tag + (table.columns[c].number ? " class=\"n\">" : ">") + html(cellOf(c)) +
              "</" + tag + ">";
    text += "</tr>\n";
  };
  if (!std::ranges::all_of(table.columns, &std::string::empty, &Column::title)) {
    text += "<tr>";
    addRow("th", [&](std::size_t c) { return table.columns[c].title; });
  }
  for (const std::vector<std::string>& row : table.rows) {
    if (row.empty()) continue;
    text += row.back() == "front" ? "<tr class=\"front\">" : "<tr>";
    addRow("td", [&](std::size_t c) { return c < row.size() ? row[c] : ""; });
  }
  return text + "</table></div>\n";
}

HtmlPage::HtmlPage(const std::string& title) : title_(title) {}

void HtmlPage::heading(const std::string& text) {
  body_ += "<h2>" + htmlText(text) + "</h2>\n";
}

void HtmlPage::paragraph(const std::string& text) {
  body_ += "<p>" + htmlText(text) + "</p>\n";
}

void HtmlPage::table(const Table& table) {
  if (!table.title.empty()) heading(table.title);
  body_ += htmlTable(table, htmlText);
  for (const std::string& note : table.notes)
    body_ += "<p class=\"note\">" + htmlText(note) + "</p>\n";
}

void HtmlPage::svg(const std::string& text) {
  body_ += text;
}

void HtmlPage::details(const std::string& title, const std::string& text) {
  body_ += "<details><summary>" + xmlText(title) + "</summary><pre>" + xmlText(text) +
           "</pre></details>\n";
}

std::string HtmlPage::text() const {
  return htmlPage(title_, "<style>" + std::string(kStyle) + "</style>",
                  "<h1>" + xmlText(title_) + "</h1>\n" + body_);
}

}  // namespace catoptric::report
