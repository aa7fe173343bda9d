#pragma once

#include <string>
#include <vector>

namespace scanloc::report {

/// The begin of a page that needs no other file, up to its body; `</body></html>` ends it.
[[nodiscard]] std::string PageHead(const std::string& title);

/// A table; whatever cells hold is escaped.
[[nodiscard]] std::string HtmlTable(const std::vector<std::string>& columns,
                                    const std::vector<std::vector<std::string>>& rows);

}  // namespace scanloc::report
