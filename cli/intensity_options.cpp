#include "cli/intensity_options.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "cli/command.hpp"
#include "cli/mount_options.hpp"
#include "cli/output.hpp"
#include "cli/progress.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/jobs/jobs.hpp"

namespace scanloc::cli {
namespace {

using Images = std::vector<dataset::RadarFile>;

bool IsOf(const std::string& method, const std::string& value) {
  return eval::ContextMethodOf(method.substr(0, method.find(':')), value).has_value();
}

absl::StatusOr<Images> ListAll(const std::vector<std::string>& folders) {
  Images all;
  for (const std::string& folder : folders) {
    ASSIGN_OR_RETURN(const Images images, dataset::ListRadar(folder));
    all.insert(all.end(), images.begin(), images.end());
  }
  std::ranges::sort(all, [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
  return all;
}

/// The image that was taken nearest in time; images are in order of time.
absl::StatusOr<std::string> NearestImage(const Images& images, std::int64_t stamp_ns,
                                         const std::string& what) {
  const auto after = std::lower_bound(images.begin(), images.end(), stamp_ns,
                                      [](const dataset::RadarFile& image, std::int64_t time_ns) {
                                        return image.stamp_ns < time_ns;
                                      });
  const auto gap_ns = [&](const dataset::RadarFile& image) {
    return std::abs(static_cast<double>(image.stamp_ns) - static_cast<double>(stamp_ns));
  };
  auto nearest = after == images.end() ? std::prev(after) : after;
  if (nearest != images.begin() && gap_ns(*std::prev(nearest)) < gap_ns(*nearest)) --nearest;
  if (gap_ns(*nearest) <= IntensityOptions::kMaxRadarGap_ns) return nearest->path;
  return absl::InvalidArgumentError(
      absl::StrCat(what, ", taken at ", stamp_ns, stamp_ns == 0 ? " ns or not known when" : " ns",
                   ", has no radar image within ", IntensityOptions::kMaxRadarGap_ns,
                   " ns; the nearest is ", nearest->path));
}

using Baselines = std::vector<std::shared_ptr<eval::IntensityContexts>>;
/// Reads what belongs to a query, by number, or after those to a place.
using Read = std::function<absl::StatusOr<dataset::Scan>(std::size_t number)>;

/// Reads each once, for all of the baselines, and hands them what they make of it.
absl::Status EncodeAll(const Baselines& baselines, const Read& read, std::size_t num_queries,
                       std::size_t num_places, std::size_t num_threads, Progress* progress) {
  const std::size_t num = num_queries + num_places;
  std::vector<std::vector<Eigen::VectorXf>> of_queries(baselines.size()), of_places(of_queries);
  for (std::size_t i = 0; i < baselines.size(); ++i) {
    of_queries[i].resize(num_queries);
    of_places[i].resize(num_places);
  }
  const auto job = [&](std::size_t number, std::size_t /*worker*/) {
    ASSIGN_OR_RETURN(const dataset::Scan scan, read(number));
    const bool of_place = number >= num_queries;
    for (std::size_t i = 0; i < baselines.size(); ++i) {
      (of_place ? of_places[i][number - num_queries] : of_queries[i][number]) =
          baselines[i]->Encode(scan.points, scan.intensities, of_place);
    }
    return absl::OkStatus();
  };
  absl::Status status =
      RunJobs(num_threads, num, job, [&](std::size_t done) { progress->Update(done, num); });
  if (!status.ok()) return status;
  for (std::size_t i = 0; i < baselines.size(); ++i) {
    if (std::ranges::all_of(of_places[i],
                            [](const Eigen::VectorXf& cells) { return cells.isZero(0.0F); })) {
      return absl::InvalidArgumentError(
          absl::StrCat("all intensities of the map's places are 0, so ", baselines[i]->name(),
                       " cannot tell them apart; were they written when the scans were made?"));
    }
    baselines[i]->Take(std::move(of_queries[i]), std::move(of_places[i]));
  }
  return absl::OkStatus();
}

}  // namespace

void IntensityOptions::Declare(CLI::App& app) {
  app.add_option("--radar", radar_,
                 "Folder of radar images (.png named by their time), for methods with -radar: each "
                 "scan of --scans and --negatives takes the nearest in time; may be given several "
                 "times")
      ->type_name("DIR");
  app.add_option("--map-radar", map_radar_, "The same for the places of the map [--radar]")
      ->type_name("DIR");
  app.add_option(
         "--radar-layout", layout_,
         "Polar, a row an azimuth with its head (Oxford Radar RobotCar); polar, a column an "
         "azimuth (MulRan); or from above, ahead up")
      ->check(CLI::IsMember({"oxford", "mulran", "cartesian"}));
  app.add_option("--radar-resolution-m", resolution_m_,
                 "A step of range, or a pixel from above [m; oxford 0.0432, mulran 0.0595]")
      ->check(InRange(0.001, 10.0));
}

dataset::RadarLayout IntensityOptions::layout() const {
  if (layout_ == "mulran") return dataset::RadarLayout::kMulran;
  return layout_ == "oxford" ? dataset::RadarLayout::kOxford : dataset::RadarLayout::kCartesian;
}

std::optional<double> IntensityOptions::resolution_m() const {
  return resolution_m_ ? resolution_m_ : dataset::DefaultResolution_m(layout());
}

absl::Status IntensityOptions::CheckUsage(const std::vector<std::string>& methods, bool in_session,
                                          double tilt_deg) const {
  const auto any = [&](const char* value) {
    return std::ranges::any_of(methods,
                               [&](const std::string& method) { return IsOf(method, value); });
  };
  if (any("radar") && (radar_.empty() || !resolution_m())) {
    return absl::InvalidArgumentError(
        radar_.empty() ? "methods with -radar need --radar"
                       : "--radar-layout cartesian needs --radar-resolution-m, a pixel's size");
  }
  if (!any("radar") && !(radar_.empty() && map_radar_.empty())) {
    return absl::InvalidArgumentError("--radar and --map-radar are for methods with -radar");
  }
  if (in_session && !map_radar_.empty()) {
    return absl::InvalidArgumentError("with --in-session the places take the images of --radar");
  }
  if (tilt_deg > 0.0 && (any("radar") || any("intensity"))) {
    return absl::InvalidArgumentError(
        "--query-tilt-deg does not go with methods with -intensity or -radar");
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::string>> IntensityOptions::FindImages(const Scans& scans) const {
  const absl::StatusOr<Images> of_queries = ListAll(radar_);
  if (!of_queries.ok()) return of_queries.status();
  ASSIGN_OR_RETURN(const Images of_places, map_radar_.empty() ? of_queries : ListAll(map_radar_));
  std::vector<std::string> paths;
  const auto add = [&](const Images& images, std::int64_t stamp_ns, const std::string& what) {
    const absl::StatusOr<std::string> path = NearestImage(images, stamp_ns, what);
    if (path.ok()) paths.push_back(*path);
    return path.status();
  };
  for (std::size_t i = 0; i < scans.queries.size(); ++i) {
    const eval::EvalQuery& query = scans.queries[i];
    const std::int64_t stamp_ns = query.stamp_ns != 0
                                      ? query.stamp_ns
                                      : dataset::StampOfName(scans.query_files[i].name).value_or(0);
    RETURN_IF_ERROR(add(*of_queries, stamp_ns, query.name));
  }
  for (std::size_t i = 0; i < scans.map.places.size(); ++i) {
    const std::int64_t stamp_ns = scans.map.places[i].stamp_ns;
    RETURN_IF_ERROR(add(of_places, stamp_ns, absl::StrCat("place ", i)));
  }
  return paths;
}

absl::Status IntensityOptions::AddTo(const Scans& scans, bool quiet,
                                     eval::EvalOptions* options) const {
  Baselines of_scans, of_images;
  for (const eval::EvalMethod& method : options->methods) {
    std::shared_ptr<eval::IntensityContexts> baseline =
        eval::MakeIntensityContexts(method.baseline, scans.map.params);
    if (baseline == nullptr) continue;
    (IsOf(method.baseline, "radar") ? of_images : of_scans).push_back(baseline);
    options->baselines.push_back(std::move(baseline));
  }
  const std::size_t num_queries = scans.queries.size();
  const std::size_t num_places = scans.map.places.size();
  const std::size_t num_threads = NumThreads(options->num_threads);
  if (!of_scans.empty()) {
    if (scans.place_files.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat("the baseline ", of_scans.front()->name(),
                       " needs the scans that the map was made of; give --map-scans"));
    }
    const Read read = [&](std::size_t number) {
      return number < num_queries
                 ? ReadSeenIntensities(scans.query_files[number], scans.query_mount)
                 : ReadSeenIntensities(scans.place_files[number - num_queries], scans.place_mount);
    };
    Progress progress("intensities read", quiet);
    RETURN_IF_ERROR(EncodeAll(of_scans, read, num_queries, num_places, num_threads, &progress));
  }
  if (of_images.empty()) return absl::OkStatus();
  ASSIGN_OR_RETURN(const std::vector<std::string> images, FindImages(scans));
  const Read read = [&](std::size_t number) {
    return dataset::ReadRadar(images[number], layout(), *resolution_m());
  };
  Progress progress("radar images read", quiet);
  return EncodeAll(of_images, read, num_queries, num_places, num_threads, &progress);
}

}  // namespace scanloc::cli
