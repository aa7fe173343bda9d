#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "scanloc/client/client.hpp"
#include "scanloc/proto/convert.hpp"
#include "support/raw_call.hpp"
#include "support/small_map.hpp"
#include "support/test_server.hpp"

/// Streams of moving robots: the client library, or messages made by hand, against a real server.
namespace scanloc::server {

inline constexpr int kNumPlaces = 6;

inline client::Client ConnectTo(const Server& server) {
  auto client = client::Client::Connect({.address = server.address()});
  if (!client.ok()) throw std::runtime_error(client.status().ToString());
  return *std::move(client);
}

/// A stream of hand-made messages.
class RawStream {
 public:
  explicit RawStream(const Server& server)
      : stub_(v1::Localization::NewStub(test::ChannelTo(server.address()))) {
    test::SetPatience(context_);
    stream_ = stub_->LocalizeStream(&context_);
  }
  /// The first request and its response.
  [[nodiscard]] bool Configure(const std::string& map = "") {
    v1::LocalizeStreamRequest request;
    request.mutable_config()->set_map(map);
    return Say(request) && response_.has_opened();
  }
  [[nodiscard]] bool Say(const v1::LocalizeStreamRequest& request) {
    return Send(request) && Hear();
  }
  [[nodiscard]] bool Send(const v1::LocalizeStreamRequest& request) {
    return stream_->Write(request);
  }
  [[nodiscard]] bool Hear() { return stream_->Read(&response_); }
  /// For other calls on the same connection.
  [[nodiscard]] v1::Localization::Stub& stub() { return *stub_; }
  [[nodiscard]] grpc::Status End() {
    stream_->WritesDone();
    return stream_->Finish();
  }
  /// The end that the server puts to it.
  [[nodiscard]] grpc::Status Await() {
    while (stream_->Read(&response_)) {
    }
    return stream_->Finish();
  }
  void HangUp() { context_.TryCancel(); }
  [[nodiscard]] const v1::LocalizeStreamResponse& response() const { return response_; }

 private:
  std::unique_ptr<v1::Localization::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::LocalizeStreamRequest, v1::LocalizeStreamResponse>>
      stream_;
  v1::LocalizeStreamResponse response_;
};

inline v1::LocalizeStreamRequest StreamRequest(int place) {
  v1::LocalizeStreamRequest request;
  *request.mutable_scan()->mutable_scan() = proto::ToProto(test::QueryScan(1, place));
  return request;
}

}  // namespace scanloc::server
