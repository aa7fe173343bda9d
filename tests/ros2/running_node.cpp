#include "ros2/running_node.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "absl/strings/str_format.h"
#include "scanloc/dataset/scan_reader.hpp"

namespace scanloc::test {
namespace {

Args NodeCommand(int domain, Args args) {
  args.insert(args.begin(), {BinDir() + "/scanloc-ros2", "--domain", std::to_string(domain)});
  return args;
}

std::string ScanPath(const std::string& drive, int scan) {
  return drive + absl::StrFormat("/velodyne/%06d.bin", scan);
}

}  // namespace

RunningNode::RunningNode(const Args& args, RosPeer::Reliability reliability)
    : robot(domain.domain()),
      process(NodeCommand(domain.domain(), args), {.environment = {CycloneOnLoopback()}}) {
  robot.Advertise("/points", "sensor_msgs/PointCloud2", reliability);
  robot.Advertise("/odom", "nav_msgs/Odometry");
  const auto has = [&](const char* option) {
    return std::find(args.begin(), args.end(), option) != args.end();
  };
  robot.Subscribe("/initialpose", "geometry_msgs/PoseWithCovarianceStamped");
  robot.Subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray");
  if (process.ReadLine() != "scanloc-ros2 ready") {
    process.Wait();
    throw std::runtime_error("not ready: " + process.stderr_text());
  }
  if (!robot.WaitForReader("/odom") ||
      (!has("--initialpose") && !robot.WaitForWriter("/initialpose")) ||
      !robot.WaitForWriter("/diagnostics")) {
    throw std::runtime_error("the robot and scanloc-ros2 do not find each other");
  }
  if (has("--points")) return;
  // What is best effort gets lost until the other side has found the publisher, too.
  WaitForDiagnosis([](const auto& heard) { return heard.values.at("cloud_publishers") == "1"; });
}

void RunningNode::SendScan(const std::string& drive, int scan, std::int64_t stamp_ns) {
  if (!robot.Publish("/points", CloudBytes(ScanOf(drive, scan), stamp_ns))) {
    throw std::runtime_error("the cloud is not sent");
  }
}

DiagnosisHeard RunningNode::WaitForDiagnosis(
    const std::function<bool(const DiagnosisHeard&)>& is_wanted) {
  DiagnosisHeard heard;
  // By time: those of minutes may have been waiting to be read.
  const auto latest = std::chrono::steady_clock::now() + RosPeer::kPatience;
  while (std::chrono::steady_clock::now() < latest) {
    const auto bytes = robot.Next("/diagnostics");
    if (!bytes) break;
    heard = ReadDiagnosis(*bytes);
    if (is_wanted(heard)) return heard;
  }
  std::string text = heard.message;
  for (const auto& [key, value] : heard.values) text += "\n  " + key + ": " + value;
  throw std::runtime_error("no such diagnosis; the last: " + text);
}

DiagnosisHeard RunningNode::WaitForMessage(const std::string& part) {
  return WaitForDiagnosis(
      [&](const DiagnosisHeard& heard) { return heard.message.find(part) != std::string::npos; });
}

SilentServer::SilentServer() : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in name{.sin_family = AF_INET};
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(name);
  auto* const any = reinterpret_cast<sockaddr*>(&name);
  if (fd_ < 0 || bind(fd_, any, size) != 0 || listen(fd_, 16) != 0 ||
      getsockname(fd_, any, &size) != 0) {
    throw std::runtime_error("cannot listen");
  }
  address_ = "127.0.0.1:" + std::to_string(ntohs(name.sin_port));
}

SilentServer::~SilentServer() { close(fd_); }

Eigen::Vector3d AnswerOfCommandLine(const std::string& drive, int scan) {
  const auto table = ParseCsv(MustScanloc(
      {"locate", Town().map1, "--scan", ScanPath(drive, scan), "--csv", "-", "--quiet"}));
  const auto number = [&](const char* column) { return table.Number(0, column).value().value(); };
  return Eigen::Vector3d(number("x"), number("y"), number("z"));
}

PointCloud ScanOf(const std::string& drive, int scan) {
  return dataset::ReadScan(ScanPath(drive, scan)).value().points;
}

}  // namespace scanloc::test
