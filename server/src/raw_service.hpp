#pragma once

#include <grpcpp/impl/codegen/rpc_service_method.h>
#include <grpcpp/impl/codegen/server_callback_handlers.h>
#include <grpcpp/impl/codegen/service_type.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <functional>

namespace scanloc::server {

/// A service whose methods, unary ones included, are streams of bytes to the server: on the wire
/// that is the same, but nothing of a request is received before the method asks for it. gRPC's own
/// unary methods are called with the whole request in memory, whoever sent it.
class RawService : public grpc::Service {
 public:
  using Reactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;
  using Begin = std::function<Reactor*(grpc::CallbackServerContext*)>;

 protected:
  /// The path, such as "/scanloc.v1.Localization/Localize", must be a literal.
  void Serve(const char* path, Begin begin) {
    AddMethod(new grpc::internal::RpcServiceMethod(path, grpc::internal::RpcMethod::BIDI_STREAMING,
                                                   nullptr));
    MarkMethodRawCallback(
        num_methods_++, new grpc::internal::CallbackBidiHandler<grpc::ByteBuffer, grpc::ByteBuffer>(
                            std::move(begin)));
  }

 private:
  int num_methods_ = 0;
};

}  // namespace scanloc::server
