#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/connection_options.hpp"
#include "cli/drive_options.hpp"
#include "cli/output.hpp"
#include "cli/progress.hpp"
#include "cli/replay.hpp"
#include "scanloc/client/offline_client.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/dataset/drive.hpp"
#include "scanloc/dataset/scan_reader.hpp"
#include "scanloc/report/query_result.hpp"
#include "scanloc/report/result_text.hpp"

namespace scanloc::cli {
namespace {

using Clock = std::chrono::steady_clock;

std::int64_t NsSince(Clock::time_point start) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start).count();
}

class LocateCommand : public Command {
 public:
  [[nodiscard]] std::string name() const override { return "locate"; }
  [[nodiscard]] std::string summary() const override {
    return "Say where scans were taken, by a map file or a server";
  }
  void Declare(CLI::App& app) override;
  [[nodiscard]] absl::Status CheckUsage() const override;
  [[nodiscard]] absl::Status Run() override;

 private:
  void DeclareQuery(CLI::App& app);
  void DeclareServer(CLI::App& app);
  void DeclareTruth(CLI::App& app);
  void DeclareSequence(CLI::App& app);

  /// Who answers, and the parameters of the map that is asked.
  struct Answerer {
    std::shared_ptr<const client::LocalizationClient> client;
    Params params;
  };
  [[nodiscard]] absl::StatusOr<Answerer> OpenAnswerer() const;
  [[nodiscard]] Query MakeQuery(const Params& params) const;
  [[nodiscard]] std::chrono::milliseconds budget() const {
    return std::chrono::milliseconds(budget_ms_.value_or(0));
  }
  [[nodiscard]] absl::StatusOr<std::vector<dataset::ScanFile>> ChooseScans() const;
  /// By file name; empty without --truth.
  [[nodiscard]] absl::StatusOr<std::map<std::string, Pose>> ReadTruth() const;
  /// By file name; empty without --odometry.
  [[nodiscard]] absl::StatusOr<std::map<std::string, Pose>> ReadOdometry() const;
  [[nodiscard]] absl::StatusOr<std::vector<report::QueryResult>> AskAll(
      const std::vector<dataset::ScanFile>& scans, const std::map<std::string, Pose>& odometry,
      const Answerer& answerer);
  [[nodiscard]] absl::StatusOr<std::vector<report::QueryResult>> ReplayAll(
      const Answerer& answerer) const;
  [[nodiscard]] absl::StatusOr<LocalizeReply> Ask(const Answerer& answerer, PointView scan,
                                                  const client::RequestOptions& request) const;
  [[nodiscard]] absl::Status Print(const std::vector<report::QueryResult>& results,
                                   const Params& params) const;

  std::string map_;
  std::string scan_;
  std::string scans_dir_;
  std::string replay_;
  ScanSelection selection_;
  bool skip_bad_scans_ = false;
  bool quiet_ = false;

  std::string method_;
  std::optional<int> num_candidates_;
  std::optional<double> threshold_;
  std::optional<double> min_confidence_;
  std::optional<int> budget_ms_;
  int top_ = 1;

  std::string csv_;
  bool json_ = false;

  Connection server_;
  std::string map_name_;  // at the server
  std::string send_ = "scan";
  double deadline_s_ = 5.0;

  PoseOptions truth_;
  double within_m_ = 8.0;

  bool sequence_ = false;
  std::string odometry_;
  double max_step_m_ = client::StreamOptions().max_step_m;

  std::size_t num_skipped_ = 0;
  std::string first_skipped_;
};

void LocateCommand::Declare(CLI::App& app) {
  app.add_option("MAP", map_, "Map file; or ask a server with --server");
  auto* scan = app.add_option("--scan", scan_, "One scan (.bin, .pcd, .ply)")->type_name("FILE");
  app.add_option("--scans", scans_dir_, "Folder of scans, or one with a folder velodyne")
      ->type_name("DIR")
      ->excludes(scan);
  app.add_option(
         "--replay", replay_,
         "Queries that a server kept (scanlocd --capture-dir): a file or a folder; with the "
         "options they had, but for those given here")
      ->type_name("PATH");
  app.add_flag("--skip-bad-scans", skip_bad_scans_,
               "Pass over scans of the folder that cannot be read, instead of stopping");
  auto* csv = app.add_option("--csv", csv_,
                             "Write CSV to a file, replaced if it is there; - is "
                             "standard output")
                  ->type_name("FILE");
  app.add_flag("--json", json_, "One JSON document on standard output")->excludes(csv);
  AddQuietOption(app, &quiet_);
  DeclareQuery(app);
  selection_.Declare(app);
  DeclareServer(app);
  DeclareSequence(app);
  DeclareTruth(app);
  app.footer(
      "CSV columns: query,outcome,place,session,distance,confidence,yaw_deg,lateral_m,x,y,z,qx,qy,"
      "qz,qw;\n"
      "with --top above 1 then rank, with --truth then true_place_error_m,error_m,yaw_error_deg,"
      "true_x,true_y,\nheight_error_m,missed (of plane+height+heading; empty: right), "
      "with --sequence then num_scans,relocated.\n"
      "\"Not recognised\" is an answer: the exit status is 0.\n"
      "Examples:\n"
      "  scanloc locate town.scanloc --scan wakeup.pcd\n"
      "  scanloc locate town.scanloc --scans drive2 --method a-cc --csv answers.csv\n"
      "  scanloc locate town.scanloc --scans drive2 --truth drive2/poses.txt\n"
      "  scanloc locate town.scanloc --scans drive1 --every 2 --offset 1 --truth drive1/poses.txt\n"
      "  scanloc locate town.scanloc --bag drive.mcap --sequence --poses-from /odom\n"
      "  scanloc locate town.scanloc --scans drive2 --sequence --odometry wheels.txt\n"
      "  scanloc locate town.scanloc --replay captured\n"
      "  scanloc locate --server 127.0.0.1:50061 --map town --send descriptor --scans drive2");
}

void LocateCommand::DeclareQuery(CLI::App& app) {
  const char* group = "How the map is searched";
  app.add_option(
         "--method", method_,
         "auto, or the paper's pc, cc, a-pc or a-cc; -naive and -brute behind these are slow "
         "references [auto; where the map has no structures a-pc, or a-cc where it has no pc]")
      ->check([](const std::string& name) {
        return absl::StrCat(ParseMethod(name).status().message());
      })
      ->group(group);
  app.add_option("--candidates", num_candidates_,
                 "Places taken from the k-d tree [the map's, but at least --top; with auto 100 of "
                 "each kind of context]")
      ->check(InRange(1, limits::kMaxCandidates))
      ->group(group);
  app.add_option("--threshold", threshold_,
                 "Distance up to which a place is recognised, in [0, 1]; not for auto [the map's]")
      ->check(InRange(0.0, 1.0))
      ->group(group);
  app.add_option("--min-confidence", min_confidence_,
                 "Least confidence that is localized, in [0, 1]; for auto [the map's]")
      ->check(InRange(0.0, 1.0))
      ->group(group);
  app.add_option("--budget-ms", budget_ms_,
                 "Longest time for verifying candidates, the best so far is the answer; for auto "
                 "[none]")
      ->check(InRange(1, 1e6))
      ->group(group);
  app.add_option("--top", top_, "Candidates told for each query, best first")
      ->check(InRange(1, limits::kMaxCandidates))
      ->capture_default_str()
      ->group(group);
}

void LocateCommand::DeclareServer(CLI::App& app) {
  const char* group = "Asking a server";
  auto* server = DeclareConnection(app, group, &server_);
  app.add_option("--map", map_name_, "Name of the map at the server [its only one]")
      ->needs(server)
      ->group(group);
  app.add_option("--send", send_, "What is sent: the scan, or its descriptors made here")
      ->check(CLI::IsMember({"scan", "descriptor"}))
      ->capture_default_str()
      ->needs(server)
      ->group(group);
  app.add_option("--deadline-s", deadline_s_, "Longest wait for an answer [s]")
      ->check(InRange(0.001, 3600.0))
      ->capture_default_str()
      ->needs(server)
      ->group(group);
}

void LocateCommand::DeclareSequence(CLI::App& app) {
  const char* group = "A robot that keeps moving";
  auto* sequence =
      app.add_flag("--sequence", sequence_,
                   "The scans are of one drive, in order: each is answered in the light of those "
                   "before it, by auto")
          ->group(group);
  auto* odometry = app.add_option("--odometry", odometry_,
                                  "Poses of the folder's scans in any frame, as the robot reckons "
                                  "them; of the same formats as --truth, recognised")
                       ->type_name("FILE")
                       ->needs(sequence)
                       ->group(group);
  app.add_option("--max-step-m", max_step_m_,
                 "Without odometry: farthest the robot goes from one scan to the next [m]")
      ->check(InRange(0.001, 1000.0))
      ->capture_default_str()
      ->needs(sequence)
      ->excludes(odometry)
      ->group(group);
}

void LocateCommand::DeclareTruth(CLI::App& app) {
  truth_.Declare(app, "--truth",
                 "True poses of the folder's scans, all of them: adds errors and a summary");
  truth_.DeclareBag(app);
  app.add_option("--within-m", within_m_, "A place this near to the query counts as recalled [m]")
      ->check(InRange(0.0, 1e6))
      ->capture_default_str();
}

absl::Status LocateCommand::CheckUsage() const {
  const auto wrong = [](const char* message) { return absl::InvalidArgumentError(message); };
  if (map_.empty() == server_.address.empty()) {
    return wrong("give either a map file or --server HOST:PORT");
  }
  const int num_sources = static_cast<int>(!scan_.empty()) + static_cast<int>(!scans_dir_.empty()) +
                          static_cast<int>(!replay_.empty()) + static_cast<int>(truth_.has_bag());
  if (num_sources != 1) {
    return wrong("give one of --scan FILE, --scans DIR, --bag FILE and --replay PATH");
  }
  if (truth_.has_bag()) {
    if (absl::Status s = truth_.CheckUsage(scans_dir_); !s.ok()) return s;
  }
  if (!truth_.poses_file().empty() && scans_dir_.empty()) {
    return wrong("--truth needs --scans: its rows are paired with the scans of the folder");
  }
  if (sequence_ && scans_dir_.empty() && !truth_.has_bag()) {
    return wrong("--sequence needs --scans or --bag: a drive is a folder of scans, or a bag");
  }
  if (sequence_ && !method_.empty() && method_ != "auto") {
    return wrong("--sequence goes with the method auto only");
  }
  if (num_candidates_.has_value() && *num_candidates_ < top_) {
    return wrong("--candidates is less than --top; no more can be told than are found");
  }
  return selection_.CheckUsage();
}

absl::StatusOr<LocateCommand::Answerer> LocateCommand::OpenAnswerer() const {
  Answerer answerer;
  if (server_.address.empty()) {
    auto offline = client::OfflineClient::Open(map_, map_);
    if (!offline.ok()) return offline.status();
    answerer.client = *std::move(offline);
  } else {
    Connection server = server_;
    server.deadline = std::chrono::milliseconds(static_cast<std::int64_t>(deadline_s_ * 1000.0));
    absl::StatusOr<client::Client> online = Connect(server);
    if (!online.ok()) return online.status();
    answerer.client = std::make_shared<const client::Client>(*std::move(online));
  }
  absl::StatusOr<MapInfo> info = answerer.client->GetMapInfo(map_name_);
  if (!info.ok()) return info.status();
  answerer.params = std::move(info->params);
  return answerer;
}

absl::StatusOr<LocalizeReply> LocateCommand::Ask(const Answerer& answerer, PointView scan,
                                                 const client::RequestOptions& request) const {
  return send_ == "descriptor" ? answerer.client->LocalizeByDescriptor(scan, request)
                               : answerer.client->LocalizeScan(scan, request);
}

Query LocateCommand::MakeQuery(const Params& params) const {
  Query query;
  if (!method_.empty()) query.method = *ParseMethod(method_);
  query.num_candidates = num_candidates_;
  const bool is_auto = MethodOf(query, params).automatic;
  if (!is_auto && !num_candidates_.has_value() && top_ > params.search.num_candidates) {
    query.num_candidates = top_;
  }
  query.threshold = threshold_;
  query.min_confidence = min_confidence_;
  query.max_answers = top_;
  return query;
}

absl::StatusOr<std::vector<dataset::ScanFile>> LocateCommand::ChooseScans() const {
  if (!scan_.empty()) {
    return std::vector<dataset::ScanFile>{
        {.path = scan_, .name = std::filesystem::path(scan_).filename().string()}};
  }
  const absl::StatusOr<std::vector<dataset::ScanFile>> scans = truth_.ListScans(scans_dir_);
  if (!scans.ok()) return scans.status();
  return Select(selection_, *scans);
}

absl::StatusOr<std::map<std::string, Pose>> LocateCommand::ReadTruth() const {
  std::map<std::string, Pose> truth;
  if (truth_.poses_file().empty()) return truth;
  const absl::StatusOr<dataset::Drive> drive = truth_.OpenDrive(scans_dir_);
  if (!drive.ok()) return drive.status();
  for (const dataset::Frame& frame : drive->frames) truth[frame.name] = frame.T_map_sensor;
  return truth;
}

absl::StatusOr<std::map<std::string, Pose>> LocateCommand::ReadOdometry() const {
  std::map<std::string, Pose> odometry;
  const bool of_bag = sequence_ && truth_.has_bag_poses();
  if (odometry_.empty() && !of_bag) return odometry;
  const absl::StatusOr<dataset::Drive> drive =
      of_bag ? truth_.OpenDrive("")
             : dataset::OpenDrive({.scans_dir = scans_dir_, .poses_file = odometry_});
  if (!drive.ok()) return drive.status();
  for (const dataset::Frame& frame : drive->frames) odometry[frame.name] = frame.T_map_sensor;
  return odometry;
}

absl::StatusOr<std::vector<report::QueryResult>> LocateCommand::AskAll(
    const std::vector<dataset::ScanFile>& scans, const std::map<std::string, Pose>& odometry,
    const Answerer& answerer) {
  const client::RequestOptions request{
      .map = map_name_, .query = MakeQuery(answerer.params), .budget = budget()};
  std::optional<client::RobotStream> robot;
  if (sequence_) {
    absl::StatusOr<client::RobotStream> opened =
        answerer.client->OpenStream({.map = map_name_,
                                     .query = request.query,
                                     .max_step_m = max_step_m_,
                                     .send_descriptor = send_ == "descriptor",
                                     .budget = request.budget});
    if (!opened.ok()) return opened.status();
    robot = *std::move(opened);
  }
  std::optional<Pose> T_odometry_last;
  Progress progress("scans located", quiet_);
  std::vector<report::QueryResult> results;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    report::QueryResult result{.query = scans[i].name};
    const Clock::time_point read_start = Clock::now();
    const absl::StatusOr<dataset::Scan> scan = dataset::ReadScan(scans[i]);
    result.read_ns = NsSince(read_start);
    if (!scan.ok()) {
      if (!skip_bad_scans_ || !scan_.empty()) return scan.status();
      if (num_skipped_++ == 0) first_skipped_ = absl::StrCat(scan.status().message());
      progress.Update(i + 1, scans.size());
      continue;
    }
    const Clock::time_point ask_start = Clock::now();
    if (sequence_) {
      const auto reckoned = odometry.find(scans[i].name);
      std::optional<Pose> T_last_scan;
      if (reckoned != odometry.end()) {
        if (T_odometry_last) T_last_scan = T_odometry_last->inverse() * reckoned->second;
        T_odometry_last = reckoned->second;
      } else {
        T_odometry_last.reset();
      }
      absl::StatusOr<TrackedReply> told = robot->Locate(scan->points, T_last_scan);
      if (!told.ok()) return told.status();
      result.answer = std::move(told->reply.answer);
      result.num_scans = told->num_scans;
      result.is_relocated = told->is_relocated;
    } else {
      absl::StatusOr<LocalizeReply> reply = Ask(answerer, scan->points, request);
      if (!reply.ok()) return reply.status();
      result.answer = std::move(reply->answer);
    }
    result.ask_ns = NsSince(ask_start);
    results.push_back(std::move(result));
    if (scans.size() > 1) progress.Update(i + 1, scans.size());
  }
  return results;
}

absl::StatusOr<std::vector<report::QueryResult>> LocateCommand::ReplayAll(
    const Answerer& answerer) const {
  const absl::StatusOr<std::vector<std::string>> files = ListCapturedQueries(replay_);
  if (!files.ok()) return files.status();
  const Query given = MakeQuery(answerer.params);
  Progress progress("queries replayed", quiet_);
  std::vector<report::QueryResult> results;
  for (const std::string& file : *files) {
    const Clock::time_point read_start = Clock::now();
    const absl::StatusOr<ReplayedQuery> replayed = ReadCapturedQuery(file);
    if (!replayed.ok()) return replayed.status();
    report::QueryResult result{.query = replayed->name};
    result.read_ns = NsSince(read_start);
    const CapturedQuery& captured = replayed->query;
    client::RequestOptions request{.map = map_name_,
                                   .query = captured.query,
                                   .budget = budget_ms_ ? budget() : captured.budget};
    Query& query = request.query;
    if (given.method) query.method = given.method;
    if (given.num_candidates) query.num_candidates = given.num_candidates;
    if (given.threshold) query.threshold = given.threshold;
    if (given.min_confidence) query.min_confidence = given.min_confidence;
    query.max_answers = std::max(query.max_answers, top_);
    const Clock::time_point ask_start = Clock::now();
    absl::StatusOr<LocalizeReply> reply =
        captured.descriptor ? answerer.client->LocalizeDescriptor(*captured.descriptor, request)
                            : Ask(answerer, captured.scan, request);
    if (!reply.ok()) return reply.status();
    result.ask_ns = NsSince(ask_start);
    result.answer = std::move(reply->answer);
    results.push_back(std::move(result));
    if (files->size() > 1) progress.Update(results.size(), files->size());
  }
  return results;
}

absl::Status LocateCommand::Print(const std::vector<report::QueryResult>& results,
                                  const Params& params) const {
  const report::ResultFormat format{.all_candidates = top_ > 1,
                                    .truth = !truth_.poses_file().empty(),
                                    .sequence = sequence_,
                                    .within_m = within_m_};
  const std::string summary = report::SummaryText(results, format);
  if (json_ || csv_ == "-") {
    const std::string method = method_.empty() ? MethodName(DefaultMethod(params)) : method_;
    if (!quiet_) std::fputs(summary.c_str(), stderr);
    return WriteText("-", json_ ? report::ResultsAsJson(results, method, format)
                                : report::ResultsAsCsv(results, format));
  }
  if (!csv_.empty()) {
    if (absl::Status s = WriteText(csv_, report::ResultsAsCsv(results, format)); !s.ok()) return s;
    return WriteText("-", summary);
  }
  return WriteText("-", report::ResultsAsTable(results, format) + summary);
}

absl::Status LocateCommand::Run() {
  if (!replay_.empty()) {
    const absl::StatusOr<Answerer> answerer = OpenAnswerer();
    if (!answerer.ok()) return answerer.status();
    const absl::StatusOr<std::vector<report::QueryResult>> results = ReplayAll(*answerer);
    if (!results.ok()) return results.status();
    return Print(*results, answerer->params);
  }
  const absl::StatusOr<std::vector<dataset::ScanFile>> scans = ChooseScans();
  if (!scans.ok()) return scans.status();
  const absl::StatusOr<std::map<std::string, Pose>> truth = ReadTruth();
  if (!truth.ok()) return truth.status();
  const absl::StatusOr<Answerer> answerer = OpenAnswerer();
  if (!answerer.ok()) return answerer.status();

  const absl::StatusOr<std::map<std::string, Pose>> odometry = ReadOdometry();
  if (!odometry.ok()) return odometry.status();
  absl::StatusOr<std::vector<report::QueryResult>> results = AskAll(*scans, *odometry, *answerer);
  if (!results.ok()) return results.status();
  for (report::QueryResult& result : *results) {
    const auto found = truth->find(result.query);
    if (found != truth->end()) result.T_map_true = found->second;
  }
  if (num_skipped_ > 0) {
    std::fprintf(stderr, "skipped %zu of %zu scans that could not be read, the first: %s\n",
                 num_skipped_, scans->size(), Printable(first_skipped_).c_str());
  }
  return Print(*results, answerer->params);
}

}  // namespace

std::unique_ptr<Command> MakeLocateCommand() { return std::make_unique<LocateCommand>(); }

}  // namespace scanloc::cli
