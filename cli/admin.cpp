#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/connection_options.hpp"
#include "cli/output.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::cli {
namespace {

class AdminCommand : public Command {
 public:
  AdminCommand() : Command("admin", "Tell a running server to load, reload or unload a map") {}

  void Declare(CLI::App& app) override {
    app.add_option("ACTION", action_, "reload, load or unload")
        ->check(CLI::IsMember({"reload", "load", "unload"}))
        ->required();
    app.add_option("NAME", map_, "Name of the map at the server")->required();
    DeclareConnection(app, "The server", &server_)->required();
    app.add_option("--deadline-s", server_.deadline_s, "Longest wait, loading included [s]")
        ->check(InRange(0.001, 3600.0));
    app.footer(
        "The server must run with --admin, and the token be of the role admin.\n"
        "Example:\n"
        "  scanloc admin reload town --server 127.0.0.1:50061 --token-file admin.token");
  }

  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const client::Client client, Connect(server_));
    if (action_ == "unload") {
      RETURN_IF_ERROR(client.UnloadMap(map_));
      return WriteText("-", absl::StrCat("map ", Printable(map_), " out of service\n"));
    }
    ASSIGN_OR_RETURN(const MapSummary map,
                     action_ == "load" ? client.LoadMap(map_) : client.ReloadMap(map_));
    return WriteText("-", absl::StrCat("map ", Printable(map.name), " in service: ", map.num_places,
                                       " places, content id ", Printable(map.content_id),
                                       ", generation ", map.generation, "\n"));
  }

 private:
  std::string action_;
  std::string map_;
  Connection server_{.deadline_s = 60.0};
};

}  // namespace

std::unique_ptr<Command> MakeAdminCommand() { return std::make_unique<AdminCommand>(); }

}  // namespace scanloc::cli
