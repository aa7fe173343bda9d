#pragma once

#include <nanobind/nanobind.h>

#include "scanloc/client/localization_client.hpp"

/// What a map in memory and a server are asked alike.
namespace scanloc::python {

/// points: a scan, or what a Describer gave. With send_scan a server gets the scan as it is.
[[nodiscard]] LocalizeReply Ask(const client::LocalizationClient& client, nanobind::handle points,
                                const client::RequestOptions& request, bool send_scan = false);

/// A RobotStream of Python.
[[nodiscard]] nanobind::object OpenStream(const client::LocalizationClient& client,
                                          const client::StreamOptions& options);

}  // namespace scanloc::python
