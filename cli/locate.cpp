#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/connection_options.hpp"
#include "cli/locate_options.hpp"
#include "cli/output.hpp"
#include "cli/progress.hpp"
#include "scanloc/client/offline_client.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "scanloc/files/files.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/messages.hpp"
#include "scanloc/report/query_result.hpp"
#include "scanloc/report/result_text.hpp"

namespace scanloc::cli {
namespace {

/// A captured query and the name of its file.
struct ReplayedQuery {
  std::string name;
  CapturedQuery query;
};

namespace fs = std::filesystem;

/// A request and its answer.
constexpr std::int64_t kMaxFileBytes = 2LL * limits::kMaxMessageBytes;

/// The captured queries (*.query) of a folder in order of name, or the one file. NotFound: there is
/// none. InvalidArgument: a file is none, and which.
absl::StatusOr<std::vector<std::string>> ListCapturedQueries(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return std::vector<std::string>{path};
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error)) {
    if (entry.path().extension() == ".query") files.push_back(entry.path().string());
  }
  if (error) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot list folder ", path, ": ", error.message()));
  }
  if (files.empty()) {
    return absl::NotFoundError(absl::StrCat("folder ", path, " holds no captured query (*.query)"));
  }
  std::ranges::sort(files);
  return files;
}

absl::StatusOr<ReplayedQuery> ReadCapturedQuery(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path, kMaxFileBytes));
  auto query = proto::ParseCapturedQuery(bytes);
  if (!query.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("file ", path, ": ", query.status().message()));
  }
  return ReplayedQuery{.name = fs::path(path).filename().string(), .query = *std::move(query)};
}

using Clock = std::chrono::steady_clock;

std::int64_t NsSince(Clock::time_point start) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start).count();
}

class LocateCommand : public Command {
 public:
  LocateCommand() : Command("locate", "Say where scans were taken, by a map file or a server") {}
  void Declare(CLI::App& app) override { options_.Declare(app); }
  [[nodiscard]] absl::Status CheckUsage() const override { return options_.CheckUsage(); }
  [[nodiscard]] absl::Status Run() override {
    if (!options_.replay.empty()) {
      ASSIGN_OR_RETURN(const Answerer answerer, OpenAnswerer());
      ASSIGN_OR_RETURN(const std::vector<report::QueryResult> results, ReplayAll(answerer));
      return Print(results, answerer);
    }
    ASSIGN_OR_RETURN(const std::vector<dataset::ScanFile> scans, ChooseScans());
    ASSIGN_OR_RETURN(const auto truth, ReadTruth());
    ASSIGN_OR_RETURN(const Answerer answerer, OpenAnswerer());

    ASSIGN_OR_RETURN(const auto odometry, ReadOdometry());
    ASSIGN_OR_RETURN(std::vector<report::QueryResult> results, AskAll(scans, odometry, answerer));
    for (report::QueryResult& result : results) {
      const auto found = truth.find(result.query);
      if (found != truth.end()) result.T_map_true = found->second;
    }
    if (num_skipped_ > 0) {
      std::fprintf(stderr, "skipped %zu of %zu scans that could not be read, the first: %s\n",
                   num_skipped_, scans.size(), Printable(first_skipped_).c_str());
    }
    return Print(results, answerer);
  }

 private:
  /// Who answers, and the parameters of the map that is asked: of several, of the first.
  struct Answerer {
    std::shared_ptr<const client::LocalizationClient> client;
    Params params;
    bool has_several_maps = false;
    bool is_on_earth = false;  // that map knows where it stands
  };
  [[nodiscard]] absl::StatusOr<Answerer> OpenAnswerer() const {
    Answerer answerer;
    if (options_.server.address.empty()) {
      ASSIGN_OR_RETURN(answerer.client, client::OfflineClient::Open(options_.map, options_.map));
    } else {
      ASSIGN_OR_RETURN(client::Client online, Connect(options_.server));
      answerer.client = std::make_shared<const client::Client>(std::move(online));
      RETURN_IF_ERROR(LeadToMaps(*answerer.client));
    }
    absl::StatusOr<MapInfo> info = answerer.client->GetMapInfo(options_.map_name);
    if (absl::IsNotFound(info.status()) && options_.map_name.empty() && !options_.sequence) {
      ASSIGN_OR_RETURN(const std::vector<MapSummary> maps, answerer.client->ListMaps());
      const auto serving = std::ranges::find(maps, MapState::kServing, &MapSummary::state);
      answerer.has_several_maps = serving != maps.end();
      if (answerer.has_several_maps) info = answerer.client->GetMapInfo(serving->name);
    }
    if (!info.ok()) return info.status();
    answerer.is_on_earth = info->geo_origin.has_value();
    answerer.params = std::move(info->params);
    return answerer;
  }
  [[nodiscard]] std::chrono::milliseconds budget() const {
    return std::chrono::milliseconds(options_.budget_ms.value_or(0));
  }
  [[nodiscard]] absl::StatusOr<std::vector<dataset::ScanFile>> ChooseScans() const {
    if (!options_.scan.empty()) {
      return std::vector<dataset::ScanFile>{
          {.path = options_.scan,
           .name = std::filesystem::path(options_.scan).filename().string()}};
    }
    ASSIGN_OR_RETURN(const std::vector<dataset::ScanFile> scans,
                     options_.truth.ListScans(options_.scans_dir));
    return Select(options_.selection, scans);
  }
  /// Has a server that fetches maps fetch those that a prior on earth reaches.
  [[nodiscard]] absl::Status LeadToMaps(const client::LocalizationClient& client) const {
    if (!options_.prior.on_earth || !options_.map_name.empty()) return absl::OkStatus();
    // What a scan without points is answered does not matter.
    const absl::Status status =
        client.LocalizeScan({}, {.query = {.prior = options_.prior}}).status();
    return absl::IsUnavailable(status) || absl::IsNotFound(status) ? status : absl::OkStatus();
  }
  /// By file name; empty without --truth.
  [[nodiscard]] absl::StatusOr<std::map<std::string, Pose>> ReadTruth() const {
    std::map<std::string, Pose> truth;
    if (!options_.has_truth()) return truth;
    ASSIGN_OR_RETURN(const dataset::Drive drive, options_.truth.OpenDrive(options_.scans_dir));
    for (const dataset::Frame& frame : drive.frames) {
      truth[frame.name] = BaseOfSensor(options_.truth.mount(), frame.T_map_sensor);
    }
    return truth;
  }
  /// By file name; empty without --odometry.
  [[nodiscard]] absl::StatusOr<std::map<std::string, Pose>> ReadOdometry() const {
    std::map<std::string, Pose> odometry;
    const bool of_bag = options_.sequence && options_.truth.has_bag_poses();
    if (options_.odometry.empty() && !of_bag) return odometry;
    ASSIGN_OR_RETURN(const dataset::Drive drive,
                     of_bag
                         ? options_.truth.OpenDrive("")
                         : dataset::OpenDrive({.scans_dir = options_.scans_dir,
                                               .poses_file = options_.odometry,
                                               .T_body_sensor = options_.truth.T_body_sensor()}));
    for (const dataset::Frame& frame : drive.frames) {
      odometry[frame.name] = BaseOfSensor(options_.truth.mount(), frame.T_map_sensor);
    }
    return odometry;
  }
  [[nodiscard]] absl::StatusOr<std::vector<report::QueryResult>> AskAll(
      const std::vector<dataset::ScanFile>& scans, const std::map<std::string, Pose>& odometry,
      const Answerer& answerer) {
    const client::RequestOptions request{.map = options_.map_name,
                                         .query = options_.MakeQuery(answerer.params),
                                         .mount = options_.truth.mount(),
                                         .budget = budget()};
    std::optional<client::RobotStream> robot;
    if (options_.sequence) {
      ASSIGN_OR_RETURN(
          robot, answerer.client->OpenStream({.map = options_.map_name,
                                              .query = request.query,
                                              .mount = request.mount,
                                              .max_step_m = options_.max_step_m,
                                              .send_descriptor = options_.send == "descriptor",
                                              .budget = request.budget}));
    }
    std::optional<Pose> T_odometry_last;
    Progress progress("scans located", options_.quiet);
    std::vector<report::QueryResult> results;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      report::QueryResult result{.query = scans[i].name};
      const Clock::time_point read_start = Clock::now();
      const absl::StatusOr<dataset::Scan> scan = options_.scan == "-"
                                                     ? dataset::ReadScan(stdin, "standard input")
                                                     : dataset::ReadScan(scans[i]);
      result.read_ns = NsSince(read_start);
      if (!scan.ok()) {
        if (!options_.scan.empty()) return scan.status();
        if (!options_.skip_bad_scans) return WithSkipHint(scan.status());
        if (num_skipped_++ == 0) first_skipped_ = absl::StrCat(scan.status().message());
        progress.Update(i + 1, scans.size());
        continue;
      }
      const Clock::time_point ask_start = Clock::now();
      if (options_.sequence) {
        const auto reckoned = odometry.find(scans[i].name);
        std::optional<Pose> T_last_scan;
        if (reckoned != odometry.end()) {
          if (T_odometry_last) T_last_scan = T_odometry_last->inverse() * reckoned->second;
          T_odometry_last = reckoned->second;
        } else {
          T_odometry_last.reset();
        }
        ASSIGN_OR_RETURN(TrackedReply told, robot->Locate(scan->points, T_last_scan));
        result.answer = std::move(told.reply.answer);
        result.num_scans = told.num_scans;
        result.is_relocated = told.is_relocated;
      } else {
        ASSIGN_OR_RETURN(LocalizeReply reply, Ask(answerer, scan->points, request));
        result.answer = std::move(reply.answer);
      }
      result.ask_ns = NsSince(ask_start);
      results.push_back(std::move(result));
      if (scans.size() > 1) progress.Update(i + 1, scans.size());
    }
    return results;
  }
  [[nodiscard]] absl::StatusOr<std::vector<report::QueryResult>> ReplayAll(
      const Answerer& answerer) const {
    ASSIGN_OR_RETURN(const std::vector<std::string> files, ListCapturedQueries(options_.replay));
    const Query given = options_.MakeQuery(answerer.params);
    Progress progress("queries replayed", options_.quiet);
    std::vector<report::QueryResult> results;
    for (const std::string& file : files) {
      const Clock::time_point read_start = Clock::now();
      ASSIGN_OR_RETURN(const ReplayedQuery replayed, ReadCapturedQuery(file));
      report::QueryResult result{.query = replayed.name};
      result.read_ns = NsSince(read_start);
      const CapturedQuery& captured = replayed.query;
      client::RequestOptions request{.map = options_.map_name,
                                     .query = captured.query,
                                     .mount = captured.mount,
                                     .budget = options_.budget_ms ? budget() : captured.budget};
      Query& query = request.query;
      if (given.method) query.method = given.method;
      if (given.num_candidates) query.num_candidates = given.num_candidates;
      if (given.threshold) query.threshold = given.threshold;
      if (given.min_confidence) query.min_confidence = given.min_confidence;
      if (!given.prior.is_open()) query.prior = given.prior;
      query.max_answers = std::max(query.max_answers, options_.top);
      const Clock::time_point ask_start = Clock::now();
      ASSIGN_OR_RETURN(LocalizeReply reply,
                       captured.descriptor
                           ? answerer.client->LocalizeDescriptor(*captured.descriptor, request)
                           : Ask(answerer, captured.scan, request));
      result.ask_ns = NsSince(ask_start);
      result.answer = std::move(reply.answer);
      results.push_back(std::move(result));
      if (files.size() > 1) progress.Update(results.size(), files.size());
    }
    return results;
  }
  [[nodiscard]] absl::StatusOr<LocalizeReply> Ask(const Answerer& answerer, PointView scan,
                                                  const client::RequestOptions& request) const {
    return options_.send == "descriptor" ? answerer.client->LocalizeByDescriptor(scan, request)
                                         : answerer.client->LocalizeScan(scan, request);
  }
  [[nodiscard]] absl::Status Print(const std::vector<report::QueryResult>& results,
                                   const Answerer& answerer) const {
    const auto is_on_earth = [](const report::QueryResult& result) {
      const std::vector<Candidate>& candidates = result.answer.candidates;
      return std::ranges::any_of(
          candidates, [](const Candidate& candidate) { return candidate.geo.has_value(); });
    };
    const report::ResultFormat format{
        .several_maps = answerer.has_several_maps,
        .geo = answerer.is_on_earth || std::ranges::any_of(results, is_on_earth),
        .all_candidates = options_.top > 1,
        .truth = options_.has_truth(),
        .sequence = options_.sequence,
        .within_m = options_.within_m,
        .mount = options_.truth.mount(),
        .prior = options_.prior};
    const std::string summary = report::SummaryText(results, format);
    if (options_.json || options_.csv == "-") {
      const std::string method =
          options_.method.empty() ? MethodName(DefaultMethod(answerer.params)) : options_.method;
      if (!options_.quiet) std::fputs(summary.c_str(), stderr);
      return WriteText("-", options_.json ? report::ResultsAsJson(results, method, format)
                                          : report::ResultsAsCsv(results, format));
    }
    if (!options_.csv.empty()) {
      RETURN_IF_ERROR(WriteText(options_.csv, report::ResultsAsCsv(results, format)));
      return WriteText("-", summary);
    }
    return WriteText("-", report::ResultsAsTable(results, format) + summary);
  }

  LocateOptions options_;
  std::size_t num_skipped_ = 0;
  std::string first_skipped_;
};

}  // namespace

std::unique_ptr<Command> MakeLocateCommand() { return std::make_unique<LocateCommand>(); }

}  // namespace scanloc::cli
