#include "rpc/reflection_service.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <set>
#include <utility>

#include "rpc/unary_call.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {

using google::protobuf::DescriptorPool;
using FileOfMessages = google::protobuf::FileDescriptor;  // scanloc has a FileDescriptor
using grpc::reflection::v1::ServerReflectionRequest;
using grpc::reflection::v1::ServerReflectionResponse;

namespace {

/// Tools ask and go.
constexpr std::chrono::seconds kMaxReflectionSilence(60);
constexpr std::size_t kMaxAskedBytes = 4096;

constexpr const char* kReflectionName = "grpc.reflection.v1.ServerReflection";
constexpr const char* kOldName = "grpc.reflection.v1alpha.ServerReflection";

void AddFiles(const FileOfMessages& file, std::set<const FileOfMessages*>& added,
              ServerReflectionResponse& response) {
  if (!added.insert(&file).second) return;
  google::protobuf::FileDescriptorProto proto;
  file.CopyTo(&proto);
  response.mutable_file_descriptor_response()->add_file_descriptor_proto(proto.SerializeAsString());
  for (int i = 0; i < file.dependency_count(); ++i) {
    AddFiles(*file.dependency(i), added, response);
  }
}

void TellError(grpc::StatusCode code, const char* what, ServerReflectionResponse& response) {
  response.mutable_error_response()->set_error_code(code);
  response.mutable_error_response()->set_error_message(what);
}

void TellFile(const FileOfMessages* file, ServerReflectionResponse& response) {
  std::set<const FileOfMessages*> added;
  if (file == nullptr) return TellError(grpc::StatusCode::NOT_FOUND, "not known here", response);
  AddFiles(*file, added, response);
}

}  // namespace

/// One stream: a read, a write, and so on. It is among streams_ all the time, but for the moments
/// in which it makes an answer.
class ReflectionService::Stream final : public Reactor,
                                        public IdleCall,
                                        public std::enable_shared_from_this<Stream> {
 public:
  Stream(ReflectionService& service, grpc::CallbackServerContext& context)
      : service_(service), context_(context), client_(AddressOf(context)) {}

  void Start() {
    self_ = shared_from_this();
    Read();
  }

  void OnReadDone(bool ok) override {
    if (!service_.streams_.Leave(*this)) return;  // it has been ended
    if (!ok) return Finish(grpc::Status::OK);     // the client has asked all
    absl::Status status = CheckSize();
    if (status.ok()) {
      status = Respond<ServerReflectionRequest>(
          request_, &response_,
          [this](const ServerReflectionRequest& request)
              -> absl::StatusOr<ServerReflectionResponse> { return service_.Answer(request); });
    }
    if (!status.ok()) return Finish(proto::ToGrpc(status));
    is_writing_ = true;
    Wait([this] { StartWrite(&response_); });
  }

  void OnWriteDone(bool ok) override {
    if (!service_.streams_.Leave(*this)) return;  // it has been ended
    is_writing_ = false;
    if (!ok) return Finish({grpc::StatusCode::CANCELLED, "the client is gone"});
    Read();
  }

  void OnDone() override { const std::shared_ptr<Stream> self = std::move(self_); }

 private:
  void OnEvicted(const absl::Status& why) override {
    // An answer that the client does not read would hold the status up.
    if (is_writing_) context_.TryCancel();
    Finish(proto::ToGrpc(why));
  }

  [[nodiscard]] absl::Status CheckSize() const {
    if (request_.Length() <= kMaxAskedBytes) return absl::OkStatus();
    return absl::InvalidArgumentError("the request is too long for one");
  }

  void Read() {
    request_.Clear();
    Wait([this] { StartRead(&request_); });
  }

  void Wait(const std::function<void()>& start) {
    if (auto status = service_.streams_.Enter(self_, client_, start); !status.ok()) {
      Finish(proto::ToGrpc(status));
    }
  }

  ReflectionService& service_;
  grpc::CallbackServerContext& context_;
  const std::string client_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  bool is_writing_ = false;
  std::shared_ptr<Stream> self_;  // until gRPC is done with it
};

ReflectionService::ReflectionService(std::vector<std::string> services)
    : services_(std::move(services)),
      streams_({.max_idle = kMaxStreams,
                .timeout = kMaxReflectionSilence,
                .full = "as many reflection streams as the server takes are open; try again later",
                .expired = "the client was silent for too long"}) {
  const auto open = [this](grpc::CallbackServerContext* context) {
    const auto stream = std::make_shared<Stream>(*this, *context);
    stream->Start();
    return stream.get();
  };
  Serve("/grpc.reflection.v1.ServerReflection/ServerReflectionInfo", open);
  Serve("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", open);
}

void ReflectionService::Drain() { streams_.Drain(std::chrono::seconds(0)); }

ServerReflectionResponse ReflectionService::Answer(const ServerReflectionRequest& request) const {
  ServerReflectionResponse response;
  *response.mutable_original_request() = request;
  response.set_valid_host(request.host());
  const DescriptorPool& pool = *DescriptorPool::generated_pool();
  switch (request.message_request_case()) {
    case ServerReflectionRequest::kFileByFilename:
      TellFile(pool.FindFileByName(request.file_by_filename()), response);
      break;
    case ServerReflectionRequest::kFileContainingSymbol: {
      const std::string& symbol = request.file_containing_symbol();
      TellFile(pool.FindFileContainingSymbol(symbol == kOldName ? kReflectionName : symbol),
               response);
      break;
    }
    case ServerReflectionRequest::kListServices:
      for (const std::string& name : services_) {
        response.mutable_list_services_response()->add_service()->set_name(name);
      }
      response.mutable_list_services_response()->add_service()->set_name(kReflectionName);
      response.mutable_list_services_response()->add_service()->set_name(kOldName);
      break;
    case ServerReflectionRequest::kFileContainingExtension:
    case ServerReflectionRequest::kAllExtensionNumbersOfType:
      TellError(grpc::StatusCode::NOT_FOUND, "there are no extensions here", response);
      break;
    default:
      TellError(grpc::StatusCode::INVALID_ARGUMENT, "nothing is asked for", response);
  }
  return response;
}

}  // namespace scanloc::server
