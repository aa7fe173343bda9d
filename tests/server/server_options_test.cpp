#include "scanloc/server/server_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace scanloc::server {
namespace {

using ::testing::HasSubstr;

ServerOptions Good() {
  ServerOptions options;
  options.maps = {{.name = "town", .path = "/maps/town.scanloc"}};
  return options;
}

TEST(ServerOptions, AcceptsTheDefaults) { EXPECT_TRUE(Validate(Good()).ok()) << Validate(Good()); }

TEST(ServerOptions, NamesTheFirstBadField) {
  const auto refuses = [](const char* what, auto&& spoil) {
    ServerOptions options = Good();
    spoil(options);
    const absl::Status status = Validate(options);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr(what));
  };
  refuses("no map", [](ServerOptions& o) { o.maps.clear(); });
  refuses("map name \"a b\"", [](ServerOptions& o) { o.maps[0].name = "a b"; });
  refuses("map name \"\"", [](ServerOptions& o) { o.maps[0].name = ""; });
  refuses("map name", [](ServerOptions& o) { o.maps[0].name = std::string(256, 'n'); });
  refuses("map town", [](ServerOptions& o) { o.maps[0].path = ""; });
  refuses("two maps are named town", [](ServerOptions& o) { o.maps.push_back(o.maps[0]); });
  for (const char* listen :
       {"", "localhost", ":50061", "host:", "host:port", "host:65536", "h:-1"}) {
    refuses("listen", [&](ServerOptions& o) { o.listen = listen; });
  }
  refuses("without TLS", [](ServerOptions& o) { o.listen = "0.0.0.0:50061"; });
  refuses("both a certificate", [](ServerOptions& o) { o.tls.cert_file = "cert"; });
  refuses("both a certificate", [](ServerOptions& o) { o.tls.key_file = "key"; });
  refuses("CA for clients", [](ServerOptions& o) { o.tls.client_ca_file = "ca"; });
  refuses("metrics_listen", [](ServerOptions& o) { o.metrics_listen = "9464"; });
  for (const char* open : {"0.0.0.0:9464", "[::]:9464", "metrics.example:9464"}) {
    refuses("open to the network", [&](ServerOptions& o) { o.metrics_listen = open; });
  }
  refuses("num_threads", [](ServerOptions& o) { o.num_threads = -1; });
  refuses("max_inflight", [](ServerOptions& o) { o.max_inflight = 0; });
  refuses("max_message_bytes", [](ServerOptions& o) { o.max_message_bytes = 0; });
  refuses("max_memory_bytes", [](ServerOptions& o) { o.max_memory_bytes = 1 << 20; });
  refuses("--cache-dir", [](ServerOptions& o) { o.catalogue.catalogue = "/srv/catalogue"; });
  refuses("--cache-dir", [](ServerOptions& o) { o.catalogue.store = "/srv/store"; });
  refuses("cache_bytes", [](ServerOptions& o) { o.cache_bytes = -1; });
  refuses("whole_bytes", [](ServerOptions& o) { o.whole_bytes = -1; });
  refuses("receive_s", [](ServerOptions& o) { o.receive_s = 0.0; });
  refuses("stream_idle_s", [](ServerOptions& o) { o.stream_idle_s = -1.0; });
  refuses("drain_s", [](ServerOptions& o) { o.drain_s = -0.1; });
  refuses("drain_s",
          [](ServerOptions& o) { o.drain_s = std::numeric_limits<double>::quiet_NaN(); });
}

TEST(ServerOptions, AcceptsMetricsForTheNetworkInSoManyWords) {
  ServerOptions options = Good();
  options.metrics_listen = "127.0.0.1:9464";
  EXPECT_TRUE(Validate(options).ok()) << Validate(options);
  options.metrics_listen = "0.0.0.0:9464";
  options.allow_plaintext_metrics = true;
  EXPECT_TRUE(Validate(options).ok()) << Validate(options);
  options.allow_plaintext_metrics = false;
  options.allow_plaintext = true;
  EXPECT_TRUE(Validate(options).ok()) << Validate(options);
}

TEST(ServerOptions, AcceptsAnIpv6Address) {
  ServerOptions options = Good();
  options.listen = "[::1]:50061";
  EXPECT_TRUE(Validate(options).ok()) << Validate(options);
}

TEST(ParseMapSource, SplitsAtTheFirstEqualsSign) {
  EXPECT_EQ(*ParseMapSource("town=/maps/a=b.scanloc"),
            (MapSource{.name = "town", .path = "/maps/a=b.scanloc"}));
}

TEST(ParseMapSource, RefusesWhatIsNoPair) {
  for (const char* text : {"", "town", "=", "=file", "town="}) {
    EXPECT_EQ(ParseMapSource(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
}

TEST(ServerOptions, TakeMessagesThatFitTheScansTheyAllow) {
  ServerOptions options;
  EXPECT_GE(LargestMessageBytes(options), 12 * options.max_points + 4096);
  options.max_points = 1000;
  EXPECT_LT(LargestMessageBytes(options), options.max_message_bytes);
  // Descriptors of the largest shape fit, whatever the scans.
  EXPECT_GE(LargestMessageBytes(options),
            2 * 2 * limits::kMaxDescriptorSide * limits::kMaxDescriptorSide + 4096);
  options.max_points = static_cast<int>(limits::kMaxPointsPerScan);
  EXPECT_EQ(LargestMessageBytes(options), options.max_message_bytes);
}

}  // namespace
}  // namespace scanloc::server
