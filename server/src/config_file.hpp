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
  /// Of what it reads later, flags of this program take true and false alone: CLI11 takes a date
  /// for the number that it begins with, and that for true. The program must outlive it.
  void KnowFlagsOf(const CLI::App& app) { app_ = &app; }

  [[nodiscard]] std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

  /// What is wrong with the file, with its line, if the error is about an option that it gives and
  /// the command line does not.
  [[nodiscard]] std::optional<std::string> Explain(const CLI::ParseError& error,
                                                   const std::string& path,
                                                   const std::vector<std::string>& arguments) const;

 private:
  void Check(const CLI::ConfigItem& item) const;

  const CLI::App* app_ = nullptr;
  mutable std::vector<std::string> lines_;
  mutable std::vector<std::string> names_;  // of the options that it gives
};

}  // namespace scanloc::server
