// Messages of every type that are malformed, truncated or hostile, and bytes that are no protocol
// at all, sent to the real program: it answers the next good query as if nothing had been.
#include <random>

#include "grpc/health/v1/health.pb.h"
#include "metered_scanlocd.hpp"
#include "scanloc/v1/admin.pb.h"
#include "support/http2.hpp"
#include "support/small_maps.hpp"

namespace scanloc::server {
namespace {

constexpr char kLocalization[] = "/scanloc.v1.Localization/";
constexpr char kViewer[] = "/scanloc.v1.Viewer/";
constexpr char kAdmin[] = "/scanloc.v1.Admin/";
constexpr char kHealth[] = "/grpc.health.v1.Health/";
constexpr char kReflection[] = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";

/// A method, and good messages for it.
struct Method {
  std::string path;
  bool is_stream = false;
  bool is_admin = false;
  std::vector<std::string> messages;

  friend void PrintTo(const Method& method, std::ostream* out) { *out << method.path; }
};

v1::LocalizeOptions AllOptions() {
  v1::LocalizeOptions options;
  options.set_method(v1::METHOD_AUTO);
  options.set_num_candidates(3);
  options.set_threshold(0.5);
  options.set_max_answers(2);
  options.set_min_confidence(0.5);
  options.set_budget_ms(100);
  return options;
}

std::vector<std::string> Queries() {
  v1::LocalizeRequest scan = test::ScanRequest(PointCloud(5, Point{1.0F, 2.0F, 3.0F}), "town");
  v1::LocalizeRequest descriptors =
      test::DescriptorRequest(test::QueryScan(1, 2), test::SmallParams());
  *scan.mutable_options() = AllOptions();
  *descriptors.mutable_options() = AllOptions();
  return {scan.SerializeAsString(), descriptors.SerializeAsString()};
}

std::vector<std::string> StreamQueries() {
  v1::LocalizeStreamRequest request;
  *request.mutable_config()->mutable_options() = AllOptions();
  request.mutable_config()->set_max_step_m(3.0);
  std::vector<std::string> messages = {request.SerializeAsString()};
  for (const std::string& bytes : Queries()) {
    v1::LocalizeRequest query;
    query.ParseFromString(bytes);
    v1::StreamScan& scan = *request.mutable_scan();
    if (query.has_scan()) *scan.mutable_scan() = query.scan();
    if (query.has_descriptors()) *scan.mutable_descriptors() = query.descriptors();
    proto::SetOdometry(Pose::Identity(), &scan);
    messages.push_back(request.SerializeAsString());
  }
  return messages;
}

/// A message whose only field, the first, is a text; all of such are alike on the wire.
std::string TextMessage(const std::string& text) {
  v1::GetMapInfoRequest request;
  request.set_map(text);
  return request.SerializeAsString();
}

/// ServerReflectionRequest by field number: a file's name, a symbol, an extension, a list.
std::vector<std::string> ReflectionRequests() {
  const std::string symbol = "scanloc.v1.Localization";
  const auto field = [](char tag, const std::string& value) {
    return std::string(1, tag) + static_cast<char>(value.size()) + value;
  };
  return {field('\x1a', "scanloc/v1/map.proto"), field('\x22', symbol),
          field('\x2a', field('\x0a', symbol) + "\x10\x01"), field('\x32', symbol),
          field('\x3a', "")};
}

/// Administration is of a map that no query asks.
std::vector<Method> Methods() {
  const std::string other = TextMessage("other");
  const std::string health = TextMessage("scanloc.map/town");
  return {{std::string(kLocalization) + "Localize", false, false, Queries()},
          {std::string(kLocalization) + "LocalizeStream", true, false, StreamQueries()},
          {std::string(kLocalization) + "ListMaps", false, false, {TextMessage("unknown field")}},
          {std::string(kLocalization) + "GetMapInfo", false, false, {TextMessage("town")}},
          {std::string(kLocalization) + "ListPlaces", false, false, {TextMessage("town")}},
          {std::string(kViewer) + "GetPlace", false, false, {TextMessage("town")}},
          {std::string(kViewer) + "ListConfusablePairs", false, false, {TextMessage("town")}},
          {std::string(kViewer) + "ListAnswers", false, true, {TextMessage("town")}},
          {std::string(kAdmin) + "ReloadMap", false, true, {other}},
          {std::string(kAdmin) + "LoadMap", false, true, {other}},
          {std::string(kAdmin) + "UnloadMap", false, true, {other}},
          {std::string(kHealth) + "Check", false, false, {health}},
          {std::string(kHealth) + "Watch", true, false, {health}},
          {kReflection, true, false, ReflectionRequests()}};
}

std::string NameOf(const testing::TestParamInfo<Method>& info) {
  return info.param.path.substr(info.param.path.rfind('/') + 1) + std::to_string(info.index);
}

class HostileMessages : public MeteredScanlocdTest {
 protected:
  void SetUp() override {
    const std::string town = dir_.File("town.scanloc");
    const std::string other = dir_.File("other.scanloc");
    test::WriteSmallMap(town, 1, kNumPlaces, test::SmallParams());
    test::WriteSmallMap(other, 2, kNumPlaces, test::SmallParams());
    std::vector<std::string> arguments = AdminArguments();
    arguments.insert(arguments.end(),
                     {"--map", "town=" + town, "--map", "other=" + other, "--log-requests", "all"});
    StartMetered(arguments);
    channel_ = test::ChannelTo(address_);
  }

  void TearDown() override {
    ExpectServes();
    ExpectStopsWell();
  }

  /// The program is the one that was started: nothing starts it again.
  void ExpectServes() const {
    const auto reply = ConnectAs(kQueryToken).LocalizeScan(test::QueryScan(1, 2), {.map = "town"});
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->answer.candidates.front().place, 2);
    AwaitMetric("scanloc_in_flight", [](double value) { return value == 0.0; });
  }

  /// Any answer will do but that there is no server, or one at its wits' end.
  void Send(const Method& method, const std::string& bytes,
            grpc_compression_algorithm compression = GRPC_COMPRESS_NONE) {
    const test::BytesOptions options{.token = method.is_admin ? kAdminToken : kQueryToken,
                                     .compression = compression};
    const grpc::Status status = method.is_stream
                                    ? StreamWithBytes(channel_, method.path, bytes, options)
                                    : CallWithBytes(channel_, method.path, bytes, options);
    ASSERT_NE(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
    ASSERT_NE(status.error_code(), grpc::StatusCode::UNKNOWN) << status.error_message();
    ASSERT_NE(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED) << status.error_message();
    ASSERT_NE(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << "it stops at the listener";
  }

  std::shared_ptr<grpc::Channel> channel_;
};

class HostileMessagesOf : public HostileMessages, public testing::WithParamInterface<Method> {
 public:
  void CutShortAnywhere();
  void WithBytesChanged();
  void OfRandomBytes();
  void ThatPromiseMoreThanTheyHold();
  void Compressed();
};

void HostileMessagesOf::CutShortAnywhere() {
  for (const std::string& message : GetParam().messages) {
    for (std::size_t size = 0; size <= message.size(); ++size) {
      ASSERT_NO_FATAL_FAILURE(Send(GetParam(), message.substr(0, size))) << size;
    }
  }
}

void HostileMessagesOf::WithBytesChanged() {
  std::mt19937 random(11);
  for (const std::string& message : GetParam().messages) {
    for (int i = 0; i < 100; ++i) {
      std::string bytes = message + std::string(random() % 3, '\xff');
      for (std::size_t change = 0; change <= random() % 4 && !bytes.empty(); ++change) {
        bytes[random() % bytes.size()] = static_cast<char>(random());
      }
      ASSERT_NO_FATAL_FAILURE(Send(GetParam(), bytes)) << i;
    }
  }
}

void HostileMessagesOf::OfRandomBytes() {
  std::mt19937 random(12);
  for (int i = 0; i < 50; ++i) {
    std::string bytes(random() % 300, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    ASSERT_NO_FATAL_FAILURE(Send(GetParam(), bytes)) << i;
  }
}

void HostileMessagesOf::ThatPromiseMoreThanTheyHold() {
  for (const int field : {1, 2, 3, 4, 7}) {
    const char tag = static_cast<char>(field << 3 | 2);
    for (const char* length : {"\xff\xff\xff\x7f", "\xff\xff\xff\xff\x0f", "\x7f",
                               "\xff\xff\xff\xff\xff\xff\xff\xff\x7f"}) {
      ASSERT_NO_FATAL_FAILURE(Send(GetParam(), std::string(1, tag) + length + "few"));
    }
    // Messages in messages, deeper than anybody means.
    std::string nested;
    for (int depth = 0; depth < 60; ++depth) {
      nested = std::string(1, tag) + static_cast<char>(nested.size()) + nested;
    }
    ASSERT_NO_FATAL_FAILURE(Send(GetParam(), nested));
    ASSERT_NO_FATAL_FAILURE(Send(GetParam(), std::string(1000, static_cast<char>(field << 3 | 3))));
  }
}

void HostileMessagesOf::Compressed() {
  for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    for (const std::string& message : GetParam().messages) {
      ASSERT_NO_FATAL_FAILURE(Send(GetParam(), message, algorithm));
    }
  }
  // Little on the wire, more than a message may have behind it.
  ASSERT_NO_FATAL_FAILURE(
      Send(GetParam(), std::string(limits::kMaxMessageBytes + 1, '\0'), GRPC_COMPRESS_GZIP));
  // What says that it is compressed, but is not.
  for (const std::string& message : GetParam().messages) {
    const test::TcpConnection connection(address_);
    connection.Send(test::Http2CallOpening(GetParam().path, kAdminToken) +
                    test::Http2Message(message, /*is_compressed=*/true));
    EXPECT_TRUE(connection.AwaitSomething());
  }
}

TEST_P(HostileMessagesOf, AreAnsweredAndForgotten) {
  for (const auto send :
       {&HostileMessagesOf::CutShortAnywhere, &HostileMessagesOf::WithBytesChanged,
        &HostileMessagesOf::OfRandomBytes, &HostileMessagesOf::ThatPromiseMoreThanTheyHold,
        &HostileMessagesOf::Compressed}) {
    (this->*send)();
    ASSERT_FALSE(HasFatalFailure());
    ExpectServes();
  }
}

INSTANTIATE_TEST_SUITE_P(Faults, HostileMessagesOf, testing::ValuesIn(Methods()), NameOf);

TEST_F(HostileMessages, OfNoProtocol) {
  const std::string preface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  std::mt19937 random(5);
  for (int i = 0; i < 100; ++i) {
    const test::TcpConnection connection(address_);
    std::string garbage(random() % 5000, '\0');
    for (char& byte : garbage) byte = static_cast<char>(random());
    connection.Send(i % 2 == 0 ? garbage : preface + garbage);
    if (i % 3 == 0) connection.ResetAtEnd();
  }
  for (std::size_t size = 0; size <= preface.size(); ++size) {
    test::TcpConnection(address_).Send(preface.substr(0, size));
  }
  const std::string tls_hello("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11);
  for (const std::string& other :
       {tls_hello + std::string(505, '\x11'), std::string("GET / HTTP/1.1\r\n\r\n"),
        std::string("SSH-2.0-OpenSSH_9.2\r\n"), std::string(1 << 20, '\0')}) {
    test::TcpConnection(address_).Send(other);
    test::TcpConnection(metrics_address_).Send(other);
  }
}

TEST_F(HostileMessages, InFramesThatAreNotAsTheyShouldBe) {
  const std::string opening =
      test::Http2CallOpening(std::string(kLocalization) + "Localize", kQueryToken);
  std::mt19937 random(6);
  for (std::size_t size = 0; size < opening.size(); size += 3) {
    test::TcpConnection(address_).Send(opening.substr(0, size));
  }
  for (int type = 0; type < 12; ++type) {
    for (const int stream : {0, 1, 2, 0x7fffffff}) {
      std::string payload(random() % 40, '\0');
      for (char& byte : payload) byte = static_cast<char>(random());
      const std::size_t announced = random() % 2 == 0 ? payload.size() : random() % 0xffffff;
      test::TcpConnection(address_).Send(opening + test::Http2Frame(static_cast<char>(type),
                                                                    static_cast<char>(random()),
                                                                    stream, payload, announced));
    }
  }
}

}  // namespace
}  // namespace scanloc::server
