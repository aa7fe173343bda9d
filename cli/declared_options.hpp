#pragma once

#include <CLI/CLI.hpp>
#include <string>

// For any program; needs nothing else of this folder.
namespace scanloc::cli {

/// Has the help show the defaults of the options declared so far, but for empty ones and where it
/// shows another text.
inline void ShowDefaults(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_default_str().empty()) option->capture_default_str();
    if (option->get_default_str() == "[]") option->default_str("");
  }
}

/// Makes the options declared so far refuse an empty value, as of "$UNSET": it would pass for 0, or
/// for an option that was not given, which may mean no encryption or no token.
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
