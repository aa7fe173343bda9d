#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <future>
#include <memory>
#include <string>

#include "scanloc/core/limits.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/v1/localization.grpc.pb.h"

/// Calls as any client of the protocol may make them, bad ones included.
namespace scanloc::test {

/// A connection of its own, not shared with other channels of the process.
inline std::shared_ptr<grpc::Channel> ChannelTo(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(limits::kMaxMessageBytes);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

/// Long enough for any machine; only a test that fails waits for it.
inline void SetPatience(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
}

/// What a call with bytes says beside them.
struct BytesOptions {
  std::string token;  ///< none if empty
  grpc_compression_algorithm compression = GRPC_COMPRESS_NONE;
};

inline void Apply(const BytesOptions& options, grpc::ClientContext& context) {
  SetPatience(context);
  if (!options.token.empty()) context.AddMetadata("authorization", "Bearer " + options.token);
  if (options.compression != GRPC_COMPRESS_NONE) {
    context.set_compression_algorithm(options.compression);
  }
}

/// Calls a method, such as "/scanloc.v1.Localization/Localize", with any bytes as the request.
inline grpc::Status CallWithBytes(const std::shared_ptr<grpc::Channel>& channel,
                                  const std::string& method, const std::string& bytes,
                                  const BytesOptions& options = {}) {
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer request(&slice, 1);
  grpc::ByteBuffer response;
  grpc::ClientContext context;
  Apply(options, context);
  std::promise<grpc::Status> ended;
  grpc::GenericStub(channel).UnaryCall(
      &context, method, {}, &request, &response,
      [&ended](const grpc::Status& status) { ended.set_value(status); });
  return ended.get_future().get();
}

/// Calls a method that streams either way with any bytes as its one request, and hangs up at the
/// first response; the status is then CANCELLED.
inline grpc::Status StreamWithBytes(const std::shared_ptr<grpc::Channel>& channel,
                                    const std::string& method, const std::string& bytes,
                                    const BytesOptions& options = {}) {
  class Call : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
   public:
    Call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
         const std::string& bytes, const BytesOptions& options) {
      Apply(options, context_);
      const grpc::Slice slice(bytes);
      request_ = grpc::ByteBuffer(&slice, 1);
      grpc::GenericStub(channel).PrepareBidiStreamingCall(&context_, method, {}, this);
      StartWriteLast(&request_, {});
      StartRead(&response_);
      StartCall();
    }
    void OnReadDone(bool ok) override {
      if (ok) context_.TryCancel();
    }
    void OnDone(const grpc::Status& status) override { ended_.set_value(status); }
    grpc::Status Await() { return ended_.get_future().get(); }

   private:
    grpc::ClientContext context_;
    grpc::ByteBuffer request_;
    grpc::ByteBuffer response_;
    std::promise<grpc::Status> ended_;
  };
  return Call(channel, method, bytes, options).Await();
}

inline v1::LocalizeRequest ScanRequest(PointView scan, const std::string& map = "") {
  v1::LocalizeRequest request;
  request.set_map(map);
  *request.mutable_scan() = proto::ToProto(scan);
  return request;
}

inline v1::LocalizeRequest DescriptorRequest(PointView scan, const Params& params) {
  v1::LocalizeRequest request;
  *request.mutable_descriptors() =
      proto::ToProto(SignedDescriptor{.signature = DescriptorSignature(params),
                                      .descriptor = Describer::Create(params)->Describe(scan)});
  return request;
}

inline grpc::Status Localize(v1::Localization::Stub& stub, const v1::LocalizeRequest& request,
                             v1::LocalizeResponse* response) {
  grpc::ClientContext context;
  SetPatience(context);
  return stub.Localize(&context, request, response);
}

}  // namespace scanloc::test
