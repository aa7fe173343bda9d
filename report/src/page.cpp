#include "page.hpp"

#include "absl/strings/str_cat.h"
#include "svg.hpp"

namespace scanloc::report {
namespace {

constexpr const char* kBegin = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
)";

constexpr const char* kStyle = R"(<style>
body { font: 15px/1.5 sans-serif; margin: 1.5em auto; padding: 0 12px; max-width: 1240px; color: #222 }
h2 { margin: 1.6em 0 .4em; font-size: 1.25em }
.table { overflow-x: auto }
table { border-collapse: collapse; margin: .6em 0 }
td, th { padding: .25em .6em; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap }
td:first-child, th:first-child { text-align: left }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 380px), 1fr));
  gap: 16px }
figure { margin: 0; padding: 8px; border: 1px solid #ddd; min-width: 0; display: flex;
  flex-direction: column; justify-content: space-between }
figcaption { font-size: 14px } figcaption b { display: block }
svg { display: block; width: 100%; height: auto }
code { overflow-wrap: anywhere }
</style></head><body>
)";

}  // namespace

std::string PageHead(const std::string& title) {
  return absl::StrCat(kBegin, "<title>", XmlEscaped(title), "</title>\n", kStyle);
}

std::string HtmlTable(const std::vector<std::string>& columns,
                      const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class=\"table\"><table><tr>";
  for (const std::string& column : columns) {
    absl::StrAppend(&html, "<th>", XmlEscaped(column), "</th>");
  }
  for (const std::vector<std::string>& row : rows) {
    html += "</tr>\n<tr>";
    for (const std::string& cell : row) absl::StrAppend(&html, "<td>", XmlEscaped(cell), "</td>");
  }
  return html + "</tr></table></div>\n";
}

}  // namespace scanloc::report
