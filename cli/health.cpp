#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/connection_options.hpp"
#include "cli/output.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::cli {
namespace {

class HealthCommand : public Command {
 public:
  HealthCommand()
      : Command("health", "Say whether a server answers for a map, or for all of its maps") {}

  void Declare(CLI::App& app) override {
    DeclareConnection(app, "The server", &server_)->required();
    app.add_option("--map", map_, "Name of the map [the server as a whole]");
    app.add_option("--deadline-s", server_.deadline_s, "Longest wait [s]")
        ->check(InRange(0.001, 3600.0));
    app.footer(
        "Exit status 0 if it answers, 1 if it does not (yet, or any more), or cannot be reached.\n"
        "Example, as a container's health check:\n"
        "  scanloc health --server 127.0.0.1:50061");
  }

  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const client::Client client, Connect(server_));
    ASSIGN_OR_RETURN(const bool is_serving, client.IsServing(map_));
    if (is_serving) return WriteText("-", "serving\n");
    return absl::UnavailableError(
        absl::StrCat("not serving ", map_.empty() ? "its maps" : map_,
                     ": it is starting or stopping, or the map does not load"));
  }

 private:
  Connection server_;
  std::string map_;
};

}  // namespace

std::unique_ptr<Command> MakeHealthCommand() { return std::make_unique<HealthCommand>(); }

}  // namespace scanloc::cli
