// Writes good inputs for every fuzz target: make_seeds DIR
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>

#include "scanloc/mapdb/use_file.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"
#include "scanloc/v1/admin.pb.h"
#include "scanloc/v1/capture.pb.h"
#include "support/map_files.hpp"
#include "support/paths.hpp"
#include "support/png_files.hpp"
#include "support/scan_files.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::test {
namespace {

class Seeds {
 public:
  explicit Seeds(const std::filesystem::path& root) : root_(root) {}

  /// An input that begins with the number of what it is for.
  void Add(const std::string& target, int choice, const std::string& name,
           const std::string& bytes) const {
    Write(target, name, std::string(1, static_cast<char>(choice)) + bytes);
  }
  void Write(const std::string& target, const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories(root_ / target);
    std::ofstream(root_ / target / name, std::ios::binary) << bytes;
  }

 private:
  std::filesystem::path root_;
};

std::string FloatRows(const PointCloud& points, int num_columns) {
  std::string bytes;
  for (const Point& p : points) {
    const float row[4] = {p.x, p.y, p.z, 0.5F};
    bytes.append(reinterpret_cast<const char*>(row),
                 static_cast<std::size_t>(num_columns) * sizeof(float));
  }
  return bytes;
}

void AddScans(const Seeds& seeds) {
  const PointCloud points = {{1.0F, 2.0F, 0.5F}, {-3.0F, 4.0F, 1.5F}, {10.0F, 0.0F, 0.0F}};
  seeds.Add("scan", 0, "kitti", FloatRows(points, 4));
  const std::string fields =
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\n";
  seeds.Add("scan", 1, "pcd_ascii", fields + "DATA ascii\n1 2 .5\n-3 4 nan\n10 0 0\n");
  seeds.Add("scan", 1, "pcd_binary", fields + "DATA binary\n" + FloatRows(points, 3));
  seeds.Add("scan", 1, "pcd_compressed",
            fields + "DATA binary_compressed\n" + std::string("\x08\0\0\0\x24\0\0\0\x03zzzz", 13));
  const std::string element =
      "element vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n";
  seeds.Add("scan", 2, "ply_ascii", "ply\nformat ascii 1.0\n" + element + "1 2 3\n4 5 6\n7 8 9\n");
  seeds.Add("scan", 2, "ply_binary",
            "ply\nformat binary_little_endian 1.0\n" + element + FloatRows(points, 3));
  seeds.Add("scan", 3, "nclt", std::string(24, '\x50'));
  seeds.Add("scan", 4, "oxford_left", FloatRows(points, 4));
  seeds.Add("scan", 5, "oxford_right", FloatRows(points, 4));
  seeds.Add("scan", 6, "npy_float32", NaverBytes(points));
  seeds.Add("scan", 7, "npy_matrix", NaverBytes(points));
  seeds.Add("scan", 8, "radar_oxford", PngBytes(14, 1, OxfordHead(700) + "abc"));
  seeds.Add("scan", 9, "radar_mulran", PngBytes(2, 3, "abcdef"));
  seeds.Add("scan", 10, "radar_cartesian", PngBytes(2, 2, "abcd"));
  seeds.Add("scan", 6, "npy_int16",
            NpyBytes("{'shape': (2, 3), 'fortran_order': True, 'descr': '<i2'}",
                     std::string("\0\x10\0\x11\0\x12\0\x13\0\x14\0\x15", 12)));
}

void AddPoses(const Seeds& seeds) {
  const std::string identity = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  seeds.Add("poses", 0, "auto", identity + identity);
  seeds.Add("poses", 1, "kitti", identity);
  seeds.Add("poses", 2, "tum", "# stamp\n1.5 1 2 3 0 0 0 1\n");
  seeds.Add("poses", 3, "mulran", "1567496784952532897,1,0,0,5,0,1,0,6,0,0,1,7\n");
  seeds.Add("poses", 4, "nclt", "1357847247396864,1,2,3,0,0,1.5\n1,nan,0,0,0,0,0\n");
  seeds.Add("poses", 5, "oxford",
            "timestamp,ins_status,latitude,longitude,altitude,northing,easting,down,utm_zone,"
            "velocity_north,velocity_east,velocity_down,roll,pitch,yaw\n"
            "1547120789640420,INS_SOLUTION_GOOD,1,2,3,4,5,6,30U,0,0,0,0,0,1\n");
  seeds.Add("poses", 6, "naver", "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1\n");
  seeds.Add("poses", 6, "naver_lines", "1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n");
  seeds.Add("poses", 7, "matrix", "1,0,0,5,\n0,1,0,6,\n0,0,1,7,\n0,0,0,1.5,\n");
  seeds.Add("poses", 8, "kitti360", "3 " + identity);
  seeds.Add("poses", 0, "headline", "time,x,y,z,qw,qx,qy,qz\n1.5,1,2,3,1,0,0,0\n");
  seeds.Add("poses", 0, "two_stamps", "7 5 1 2 3 0 0 0 1\n");
  seeds.Add("poses", 9, "times", "0.0\n1.5e0\n1567496784.952532897\n");
  seeds.Add("poses", 11, "fixes",
            "stamp,latitude,longitude,altitude\n1567410202.5,48.2,11.6,519.5\n"
            "1567410203.5,48.3,11.6,nan\n");
  // Header, status, position, and the covariance with its kind.
  const std::string stamp("\x0c\0\0\0\x05\0\0\0", 8);
  const std::string rest(3 * 8 + 9 * 8 + 1, '\0');
  seeds.Add("poses", 12, "fix_ros1",
            std::string(4, '\0') + stamp + std::string("\3\0\0\0gps", 7) +
                std::string("\0\1\0", 3) + rest);
  seeds.Add("poses", 13, "fix_cdr",
            std::string("\0\1\0\0", 4) + stamp + std::string("\4\0\0\0gps\0", 8) +
                std::string("\0\0\1\0\0\0\0\0", 8) + rest);
  seeds.Add("poses", 10, "calib", "P0: 1 2\nTr: " + identity);
  seeds.Add(
      "poses", 10, "calib_json",
      R"({"Extrinsic": {"Lidar": [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}})");
}

void AddMaps(const Seeds& seeds) {
  for (const char* golden :
       {"golden_map_v1.scanloc", "golden_map_v2.scanloc", "golden_map_v16.scanloc"}) {
    seeds.Write("map", golden, ReadFile(SourceDir() + "/tests/data/" + golden));
  }
  seeds.Write("map", "sqlite", "SQLite format 3");
  MapUse use{.content_id = "abc", .since_ns = 1, .until_ns = 2, .num_localized = 3};
  use.places[7] = {.num_found = 3, .confidence = 0.9, .disagreement = 0.1, .last_found_ns = 2};
  seeds.Write("map", "health", mapdb::EncodeUse(use));
}

void AddBags(const Seeds& seeds) {
  for (const char* name :
       {"zstd.mcap", "lz4.mcap", "unindexed.mcap", "unchunked.mcap", "ros1_bz2.bag", "ros1_lz4.bag",
        "ros2_file_zstd/ros2_file_zstd.db3.zstd", "ros2_message_zstd/ros2_message_zstd.db3"}) {
    const std::string path = BagPath(name);
    seeds.Write("bag", std::filesystem::path(path).filename().string(), ReadFile(path));
  }
}

void AddNames(const Seeds& seeds) {
  v1::ReloadMapRequest request;
  request.set_map("town");
  seeds.Add("wire", 8, "name", request.SerializeAsString());
}

/// Three scans of a robot that drives from place to place, sent as points and as descriptors.
void AddStreams(const Seeds& seeds) {
  const Map map = SmallMap(1, 3);
  auto describer = Describer::Create(map.params).value();
  for (const bool send_scans : {false, true}) {
    std::string bytes;
    const auto append = [&bytes](const v1::LocalizeStreamRequest& request) {
      const std::string message = request.SerializeAsString();
      AppendBytes(bytes, static_cast<std::uint16_t>(message.size()));
      bytes += message;
    };
    v1::LocalizeStreamRequest request;
    request.mutable_config()->set_max_step_m(10.0);
    append(request);
    for (int place = 0; place < 3; ++place) {
      v1::StreamScan& message = *request.mutable_scan();
      message.Clear();
      PointCloud scan = QueryScan(1, place);
      scan.resize(std::min<std::size_t>(scan.size(), 200));  // large seeds make slow runs
      if (send_scans) {
        *message.mutable_scan() = proto::ToProto(scan);
      } else {
        *message.mutable_descriptors() = proto::ToProto(SignedDescriptor{
            .signature = DescriptorSignature(map.params), .descriptor = describer.Describe(scan)});
      }
      if (place == 2) proto::SetOdometry(Pose(Eigen::Translation3d(7.0, 0.3, 0.0)), &message);
      append(request);
    }
    seeds.Add("wire", 7, send_scans ? "stream_of_scans" : "stream_of_descriptors", bytes);
  }
}

void AddConfigs(const Seeds& seeds) {
  seeds.Add("config", 0, "tokens",
            "# who may call\nrobot query 0123456789abcdef\noperator admin fedcba9876543210\n");
  seeds.Add("config", 1, "map", "town=/srv/maps/town.scanloc");
  seeds.Add("config", 2, "toml",
            "# options\nmap = [\"town=/srv/town.scanloc\", 'b=c']\nmax-inflight = 32\n"
            "max-rate = 1.5\nlog-requests = \"none\"\nadmin = true\n[other]\nlisten = \"a:1\"\n");
}

void AddRequests(const Seeds& seeds) {
  seeds.Add("http", 0, "target", "/v1/maps/a%20town/places?page_token=x&y=a+b%26&z");
  seeds.Add("http", 1, "host", "[::1]:8080");
  seeds.Add("http", 2, "address", "127.0.0.1:8080");
}

void AddMessages(const Seeds& seeds) {
  const Map map = SmallMap(1, 3);
  auto describer = Describer::Create(map.params).value();
  const SignedDescriptor query{.signature = DescriptorSignature(map.params),
                               .descriptor = describer.Describe(QueryScan(1, 1))};
  v1::LocalizeRequest request;
  request.set_map("town");
  *request.mutable_options() = proto::ToProto(Query{.num_candidates = 2});
  *request.mutable_scan() = proto::ToProto(PointCloud(5, Point{1.0F, 2.0F, 3.0F}));
  seeds.Add("wire", 0, "scan", request.SerializeAsString());
  *request.mutable_descriptors() = proto::ToProto(query);
  seeds.Add("wire", 0, "descriptors", request.SerializeAsString());
  v1::LocalizeStreamRequest stream;
  *stream.mutable_scan()->mutable_descriptors() = request.descriptors();
  proto::SetOdometry(Pose::Identity(), stream.mutable_scan());
  seeds.Add("wire", 1, "stream", stream.SerializeAsString());
  const LocalizeReply reply{.answer = *LocalizerOf(map)->Localize(query.descriptor), .map = "town"};
  const v1::LocalizeResponse response = proto::ToProto(reply);
  seeds.Add("wire", 2, "response", response.SerializeAsString());
  seeds.Add("wire", 3, "tracked",
            proto::ToProto(TrackedReply{.reply = reply, .num_scans = 2}).SerializeAsString());
  v1::GetMapInfoResponse info;
  *info.mutable_info() = proto::ToProto(InfoOf("town", map));
  seeds.Add("wire", 4, "info", info.SerializeAsString());
  v1::CapturedQuery captured;
  *captured.mutable_request() = request;
  *captured.mutable_response() = response;
  seeds.Add("wire", 5, "captured", captured.SerializeAsString());
  seeds.Add("wire", 6, "details",
            proto::ToGrpc(proto::WithRetryAfter(absl::ResourceExhaustedError("busy"), 1.5))
                .error_details());
  AddNames(seeds);
  AddStreams(seeds);
}

}  // namespace
}  // namespace scanloc::test

int main(int argc, char** argv) try {
  if (argc != 2) return std::fprintf(stderr, "usage: make_seeds DIR\n"), 2;
  const scanloc::test::Seeds seeds(argv[1]);
  scanloc::test::AddScans(seeds);
  scanloc::test::AddPoses(seeds);
  scanloc::test::AddMaps(seeds);
  scanloc::test::AddBags(seeds);
  scanloc::test::AddConfigs(seeds);
  scanloc::test::AddRequests(seeds);
  scanloc::test::AddMessages(seeds);
  return 0;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "make_seeds: %s\n", error.what()), 1;
}
