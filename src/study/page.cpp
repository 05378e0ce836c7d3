#include "study/page.h"

#include "study/chart.h"

namespace catoptric::study {
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

Page::Page(const std::string& title) : title_(title) {}

void Page::heading(const std::string& text) {
  body_ += "<h2>" + htmlText(text) + "</h2>\n";
}

void Page::paragraph(const std::string& text) {
  body_ += "<p>" + htmlText(text) + "</p>\n";
}

void Page::table(const report::Table& table) {
  if (!table.title.empty()) heading(table.title);
  body_ += "<div class=\"wide\"><table>\n<tr>";
  const auto cell = [&](const char* tag, std::size_t column, const std::string& text) {
    const bool number = table.columns[column].number;
    body_ += std::string("<") + tag + (number ? " class=\"n\">" : ">") + htmlText(text) + "</" +
             tag + ">";
  };
  for (std::size_t c = 0; c < table.columns.size(); ++c) cell("th", c, table.columns[c].title);
  body_ += "</tr>\n";
  for (const auto& row : table.rows) {
    if (row.empty()) continue;
    body_ += row.back() == "front" ? "<tr class=\"front\">" : "<tr>";
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      cell("td", c, c < row.size() ? row[c] : "");
    body_ += "</tr>\n";
  }
  body_ += "</table></div>\n";
  for (const std::string& note : table.notes)
    body_ += "<p class=\"note\">" + htmlText(note) + "</p>\n";
}

void Page::svg(const std::string& text) {
  body_ += text;
}

void Page::details(const std::string& title, const std::string& text) {
  body_ += "<details><summary>" + xmlText(title) + "</summary><pre>" + xmlText(text) +
           "</pre></details>\n";
}

std::string Page::text() const {
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta "
         "name=\"viewport\" "
         "content=\"width=device-width\">\n<title>" +
         xmlText(title_) + "</title>\n<style>" + kStyle + "</style></head>\n<body>\n<h1>" +
         xmlText(title_) + "</h1>\n" + body_ + "</body></html>\n";
}

}  // namespace catoptric::study
