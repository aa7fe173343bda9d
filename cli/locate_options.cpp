#include "cli/locate_options.hpp"

#include "cli/command.hpp"
#include "cli/progress.hpp"
#include "scanloc/core/limits.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::cli {

void LocateOptions::Declare(CLI::App& app) {
  app.add_option("MAP", map, "Map file; or ask a server with --server");
  auto* one = app.add_option("--scan", scan, "One scan (.bin, .pcd, .ply); - is standard input")
                  ->type_name("FILE");
  app.add_option("--scans", scans_dir, "Folder of scans, or one with a folder velodyne")
      ->type_name("DIR")
      ->excludes(one);
  app.add_option(
         "--replay", replay,
         "Queries that a server kept (scanlocd --capture-dir): a file or a folder; with the "
         "options they had, but for those given here")
      ->type_name("PATH");
  app.add_flag("--skip-bad-scans", skip_bad_scans,
               "Pass over scans of the folder that cannot be read, instead of stopping");
  auto* table = app.add_option("--csv", csv,
                               "Write CSV to a file, replaced if it is there; - is "
                               "standard output")
                    ->type_name("FILE");
  app.add_flag("--json", json, "One JSON document on standard output")->excludes(table);
  AddQuietOption(app, &quiet);
  DeclareQuery(app);
  DeclarePrior(app);
  selection.Declare(app);
  DeclareServer(app);
  DeclareSequence(app);
  DeclareTruth(app);
  app.footer(
      "CSV columns: query,outcome,place,session,distance,confidence,yaw_deg,lateral_m,x,y,z,qx,qy,"
      "qz,qw,\nheading_deg (in the map), std_x_m,std_y_m,std_z_m,std_roll_deg,std_pitch_deg,"
      "std_yaw_deg (auto), and with several maps map, last of all;\n"
      "with --top above 1 then rank, with --truth then true_place_error_m,error_m,yaw_error_deg,"
      "true_x,true_y,\nheight_error_m,missed (of plane+height+heading; empty: right), "
      "with --sequence then num_scans,relocated.\n"
      "\"Not recognised\" is an answer: the exit status is 0.\n"
      "Examples:\n"
      "  scanloc locate town.scanloc --scan wakeup.pcd\n"
      "  ssh robot cat wakeup.pcd | scanloc locate town.scanloc --scan -\n"
      "  scanloc locate town.scanloc --scans drive2 --method a-cc --csv answers.csv\n"
      "  scanloc locate town.scanloc --scans drive2 --truth drive2/poses.txt\n"
      "  scanloc locate town.scanloc --scans drive1 --every 2 --offset 1 --truth drive1/poses.txt\n"
      "  scanloc locate town.scanloc --bag drive.mcap --sequence --poses-from /odom\n"
      "  scanloc locate town.scanloc --scans drive2 --sequence --odometry wheels.txt\n"
      "  scanloc locate town.scanloc --scans drive3 --T-base-sensor 0.2,0,1.1,180,0,0\n"
      "  scanloc locate house.scanloc --scan wakeup.pcd --prior 12,-4,10 --prior-heights 2.5,5.5\n"
      "  scanloc locate town.scanloc --replay captured\n"
      "  scanloc locate --server 127.0.0.1:50061 --map town --send descriptor --scans drive2");
}

void LocateOptions::DeclareQuery(CLI::App& app) {
  const OptionGroup group(app, "How the map is searched");
  app.add_option(
         "--method", method,
         "auto, or the paper's pc, cc, a-pc or a-cc; -naive and -brute behind these are slow "
         "references [auto; where the map has no structures a-pc, or a-cc where it has no pc]")
      ->check(ParsedBy(&ParseMethod));
  app.add_option("--candidates", num_candidates,
                 "Places taken from the k-d tree, with auto half of those verified [the map's, but "
                 "at least --top; with auto 100]")
      ->check(InRange(1, limits::kMaxCandidates));
  app.add_option("--threshold", threshold,
                 "Distance up to which a place is recognised, in [0, 1]; not for auto [the map's]")
      ->check(InRange(0.0, 1.0));
  app.add_option("--min-confidence", min_confidence,
                 "Least confidence that is localized, in [0, 1]; for auto [the map's]")
      ->check(InRange(0.0, 1.0));
  app.add_option("--budget-ms", budget_ms,
                 "Longest time for verifying candidates, the best so far is the answer; for auto "
                 "[none]")
      ->check(InRange(1, 1e6));
  app.add_option("--top", top, "Candidates told for each query, best first")
      ->check(InRange(1, limits::kMaxCandidates));
}

void LocateOptions::DeclarePrior(CLI::App& app) {
  const OptionGroup group(
      app, "Where the scans were taken, as far as is known: places elsewhere are left out");
  AddParsedOption(
      app, "--prior",
      [this](const std::string& text) -> absl::Status {
        ASSIGN_OR_RETURN(const auto n, ParseNumbers(text, 3, "X,Y,RADIUS"));
        prior.disc = {.x_m = n[0], .y_m = n[1], .radius_m = n[2]};
        return Validate(prior);
      },
      "Within this radius of a point of the map, along its x and y [m]")
      ->type_name("X,Y,RADIUS");
  AddParsedOption(
      app, "--prior-geo",
      [this](const std::string& text) -> absl::Status {
        ASSIGN_OR_RETURN(const auto n, ParseNumbers(text, 3, "LAT,LON,RADIUS"));
        prior.on_earth = {.latitude_deg = n[0], .longitude_deg = n[1], .radius_m = n[2]};
        return Validate(prior);
      },
      "Within this radius [m] of a point on earth, of a map, or of all at a server, that know "
      "where "
      "they stand")
      ->type_name("LAT,LON,RADIUS");
  AddParsedOption(
      app, "--prior-heights",
      [this](const std::string& text) -> absl::Status {
        ASSIGN_OR_RETURN(const auto n, ParseNumbers(text, 2, "Z0,Z1"));
        prior.heights = {.min_m = n[0], .max_m = n[1]};
        return Validate(prior);
      },
      "With the sensor between these heights along the map's z: one floor, say [m]")
      ->type_name("Z0,Z1");
  app.add_option("--prior-session", prior.sessions,
                 "In places of this session of the map; may be given several times")
      ->type_name("NAME");
}

void LocateOptions::DeclareServer(CLI::App& app) {
  const char* heading = "Asking a server";
  auto* to_server = DeclareConnection(app, heading, &server);
  const OptionGroup group(app, heading);
  app.add_option("--map", map_name, "Name of the map at the server [all that it has]")
      ->needs(to_server);
  app.add_option("--send", send, "What is sent: the scan, or its descriptors made here")
      ->check(CLI::IsMember({"scan", "descriptor"}))
      ->needs(to_server);
  app.add_option("--deadline-s", server.deadline_s, "Longest wait for an answer [s]")
      ->check(InRange(0.001, 3600.0))
      ->needs(to_server);
}

void LocateOptions::DeclareSequence(CLI::App& app) {
  const OptionGroup group(app, "A robot that keeps moving");
  auto* in_order =
      app.add_flag("--sequence", sequence,
                   "The scans are of one drive, in order: each is answered in the light of those "
                   "before it, by auto");
  auto* reckoned = app.add_option("--odometry", odometry,
                                  "Poses of the folder's scans in any frame, as the robot reckons "
                                  "them; of the same formats as --truth, recognised")
                       ->type_name("FILE")
                       ->needs(in_order);
  app.add_option("--max-step-m", max_step_m,
                 "Without odometry: farthest the robot goes from one scan to the next [m]")
      ->check(InRange(0.001, 1000.0))
      ->needs(in_order)
      ->excludes(reckoned);
}

void LocateOptions::DeclareTruth(CLI::App& app) {
  truth.Declare(app, "--truth",
                "True poses of the folder's scans, all of them: adds errors and a summary");
  truth.DeclareBag(app);
  app.add_flag("--bag-truth", bag_truth,
               "The bag's own poses (--poses-from) are true, in the map's frame: adds errors and a "
               "summary");
  truth.DeclareMount(app);
  app.add_option("--within-m", within_m, "A place this near to the query counts as recalled [m]")
      ->check(InRange(0.0, 1e6));
}

absl::Status LocateOptions::CheckUsage() const {
  const auto wrong = [](const char* message) { return absl::InvalidArgumentError(message); };
  if (map.empty() == server.address.empty()) {
    return wrong("give either a map file or --server HOST:PORT");
  }
  const int num_sources = static_cast<int>(!scan.empty()) + static_cast<int>(!scans_dir.empty()) +
                          static_cast<int>(!replay.empty()) + static_cast<int>(truth.has_bag());
  if (num_sources != 1) {
    return wrong("give one of --scan FILE, --scans DIR, --bag FILE and --replay PATH");
  }
  if (truth.has_bag()) {
    RETURN_IF_ERROR(truth.CheckUsage(scans_dir));
  }
  if (!truth.poses_file().empty() && scans_dir.empty()) {
    return wrong("--truth needs --scans: its rows are paired with the scans of the folder");
  }
  if (bag_truth && !truth.has_bag()) return wrong("--bag-truth needs --bag");
  if (sequence && scans_dir.empty() && !truth.has_bag()) {
    return wrong("--sequence needs --scans or --bag: a drive is a folder of scans, or a bag");
  }
  if (sequence && !method.empty() && method != "auto") {
    return wrong("--sequence goes with the method auto only");
  }
  if (num_candidates.has_value() && *num_candidates < top) {
    return wrong("--candidates is less than --top; no more can be told than are found");
  }
  return selection.CheckUsage();
}

Query LocateOptions::MakeQuery(const Params& params) const {
  Query query;
  if (!method.empty()) query.method = *ParseMethod(method);
  query.num_candidates = num_candidates;
  const bool is_auto = MethodOf(query, params).automatic;
  if (!is_auto && !num_candidates.has_value() && top > params.search.num_candidates) {
    query.num_candidates = top;
  }
  query.threshold = threshold;
  query.min_confidence = min_confidence;
  query.max_answers = top;
  query.prior = prior;
  return query;
}

}  // namespace scanloc::cli
