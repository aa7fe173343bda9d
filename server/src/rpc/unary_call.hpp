#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>

#include <exception>
#include <new>
#include <string>
#include <system_error>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "scanloc/core/status_macros.hpp"

/// What every RPC of one request and one response does around its work. Requests come in as bytes:
/// typed callback methods answer UNIMPLEMENTED to bytes that are no message, and unpack large ones
/// on the threads that poll the sockets.
namespace scanloc::server {

/// Runs the work; what it throws becomes a status.
template <typename Work>
absl::Status Guard(Work&& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the server is out of memory; try again later");
  } catch (const std::system_error& error) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the system does not allow it: ", error.what()));
  } catch (const std::exception& error) {
    return absl::InternalError(absl::StrCat("unexpected error: ", error.what()));
  } catch (...) {
    return absl::InternalError("unexpected error of unknown type");
  }
}

/// Cancelled or DeadlineExceeded if nobody waits for the answer any more.
[[nodiscard]] absl::Status CheckStillWanted(const grpc::CallbackServerContext& context);

/// Where the call comes from, without the port: nobody has to say who he is for it.
[[nodiscard]] std::string AddressOf(const grpc::CallbackServerContext& context);

/// The same of what gRPC calls the peer. Of an IPv6 address only the network, of 64 bits, counts:
/// whoever has one has all of its addresses.
[[nodiscard]] std::string AddressOfPeer(const std::string& peer);

/// InvalidArgument if a request that can only be small is not.
[[nodiscard]] absl::Status CheckSmall(const grpc::ByteBuffer& request);

/// InvalidArgument if the bytes are not a message of the type.
[[nodiscard]] absl::Status Parse(const grpc::ByteBuffer& bytes, google::protobuf::Message* message);
[[nodiscard]] absl::Status Serialize(const google::protobuf::Message& message,
                                     grpc::ByteBuffer* bytes);

/// Unpacks the request, lets act(request) make an absl::StatusOr<Response>, and packs that.
template <typename Request, typename Act>
absl::Status Respond(const grpc::ByteBuffer& request_bytes, grpc::ByteBuffer* response_bytes,
                     Act&& act) {
  return Guard([&]() -> absl::Status {
    Request request;
    RETURN_IF_ERROR(Parse(request_bytes, &request));
    ASSIGN_OR_RETURN(const auto response, act(request));
    return Serialize(response, response_bytes);
  });
}

}  // namespace scanloc::server
