#pragma once

#include <CLI/CLI.hpp>
#include <istream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace scanloc::server {

/// Reads a TOML file of options as CLI11 does, and knows in which line of it an option stands.
class ConfigFile : public CLI::ConfigTOML {
 public:
  [[nodiscard]] std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

  /// What is wrong with the file, with its line, if the error is about an option that it gives and
  /// the command line does not.
  [[nodiscard]] std::optional<std::string> Explain(const CLI::ParseError& error,
                                                   const std::string& path,
                                                   const std::vector<std::string>& arguments) const;

 private:
  mutable std::vector<std::string> lines_;
  mutable std::vector<std::string> names_;  // of the options that it gives
};

}  // namespace scanloc::server
