#pragma once

#include <CLI/CLI.hpp>

#include "absl/status/statusor.h"
#include "cli/answerer.hpp"
#include "scanloc/client/client.hpp"

namespace scanloc::cli {

/// Declares --server, which is returned, and how to get through to it.
CLI::Option* DeclareConnection(CLI::App& app, const char* group, ServerQuery* query);

/// Errors as of client::Client::Connect; NotFound: the token file cannot be read.
[[nodiscard]] absl::StatusOr<client::Client> Connect(const ServerQuery& query);

}  // namespace scanloc::cli
