#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/temp_dir.hpp"
#include "support/test_server.hpp"

namespace scanloc::server {

/// A server in this process, and calls as a client of its own makes them.
class ObservabilityTest : public testing::Test {
 protected:
  void Start(const ServerOptions& options) {
    server_ = test::StartServer(maps_, options);
    stub_ = v1::Localization::NewStub(test::ChannelTo(server_->address()));
  }

  [[nodiscard]] ServerOptions Options() const { return test::OptionsFor(maps_); }

  grpc::Status Ask(const v1::LocalizeRequest& request, const std::string& request_id = "") {
    context_ = std::make_unique<grpc::ClientContext>();
    test::SetPatience(*context_);
    if (!request_id.empty()) context_->AddMetadata("x-request-id", request_id);
    return stub_->Localize(context_.get(), request, &response_);
  }
  grpc::Status Ask(const std::string& request_id = "") {
    return Ask(test::ScanRequest(test::QueryScan(1, 1)), request_id);
  }

  [[nodiscard]] std::string TellsId() const {
    const auto& metadata = context_->GetServerInitialMetadata();
    const auto found = metadata.find("x-request-id");
    return found == metadata.end() ? "" : std::string(found->second.data(), found->second.size());
  }

  const test::Maps maps_ = {{"town", test::SmallMap(1, 4)}};
  test::TempDir dir_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<v1::Localization::Stub> stub_;
  std::unique_ptr<grpc::ClientContext> context_;
  v1::LocalizeResponse response_;
};

}  // namespace scanloc::server
