#include "scanloc/proto/status.hpp"

#include <cstddef>
#include <string>

#include "absl/strings/str_cat.h"

namespace scanloc::proto {
namespace {

constexpr std::size_t kMaxMessageBytes = 2048;

}  // namespace

grpc::Status ToGrpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  std::string message(status.message());
  if (message.size() > kMaxMessageBytes) {
    message.resize(kMaxMessageBytes);
    absl::StrAppend(&message, "...");
  }
  return {static_cast<grpc::StatusCode>(status.raw_code()), message};
}

absl::Status FromGrpc(const grpc::Status& status) {
  // absl::Status itself reads a code that is none of its own as kUnknown.
  return {static_cast<absl::StatusCode>(status.error_code()), status.error_message()};
}

}  // namespace scanloc::proto
