#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace scanloc::cli {

/// Makes the options declared so far refuse an empty value, as of "$UNSET": it would pass for 0, or
/// for an option that was not given, which may mean no encryption or no token. Of any program;
/// needs nothing else of this folder.
inline void RefuseEmptyValues(CLI::App& app) {
  const CLI::Validator given(
      [](std::string& text) {
        return text.empty() ? std::string("its value is empty; give one, or leave the option out")
                            : std::string();
      },
      "");
  for (CLI::Option* option : app.get_options()) {
    if (option->get_items_expected_max() > 0) option->transform(given);  // looks first
  }
}

}  // namespace scanloc::cli
