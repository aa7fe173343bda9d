// Publishing maps: publish, rollback, catalogue.
#include "scanloc/catalogue/catalogue.hpp"

#include <pwd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/time/time.h"
#include "cli/command.hpp"
#include "cli/output.hpp"
#include "scanloc/catalogue/store.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"
#include "scanloc/geo/geo_frame.hpp"
#include "scanloc/mapdb/map_file.hpp"

namespace scanloc::cli {
namespace {

using catalogue::Area;
using catalogue::Catalogue;
using catalogue::Corner;
using catalogue::Version;

void AddCatalogueOption(CLI::App& app, std::string* url) {
  app.add_option("--catalogue", *url,
                 "postgresql://USER@HOST/DATABASE, or a folder [$SCANLOC_CATALOGUE]")
      ->envname("SCANLOC_CATALOGUE")
      ->type_name("URL")
      ->required();
}

std::string LoginName() {
  const passwd* user = getpwuid(geteuid());
  return user == nullptr ? absl::StrCat("uid ", geteuid()) : std::string(user->pw_name);
}

std::string TimeText(std::int64_t unix_ms) {
  return absl::FormatTime("%Y-%m-%d %H:%M:%S", absl::FromUnixMillis(unix_ms), absl::UTCTimeZone());
}

nlohmann::json ToJson(const Version& version, bool is_live) {
  nlohmann::json corners = nlohmann::json::array();
  for (const catalogue::Corner& corner : version.area.corners) {
    corners.push_back({corner.x, corner.y});
  }
  return {{"region", version.region},
          {"content_id", version.content_id},
          {"file", version.FileName()},
          {"sha256", version.sha256},
          {"num_bytes", version.num_bytes},
          {"num_places", version.num_places},
          {"area", {{"on_earth", version.area.is_on_earth}, {"corners", std::move(corners)}}},
          {"published_by", version.published_by},
          {"published_ms", version.published_ms},
          {"live", is_live}};
}

std::string LineOf(const Version& version, bool is_live) {
  return absl::StrFormat("%-4s  %-20s  %s  %9d places  %8.1f MB  %s  %s\n", is_live ? "live" : "",
                         Printable(version.region), version.content_id, version.num_places,
                         1e-6 * static_cast<double>(version.num_bytes),
                         TimeText(version.published_ms), Printable(version.published_by));
}

class PublishCommand : public Command {
 public:
  PublishCommand() : Command("publish", "Put a map into a store and in force for a region") {}
  void Declare(CLI::App& app) override {
    app.add_option("MAP", map_, "Map file to publish")->required();
    AddCatalogueOption(app, &catalogue_);
    app.add_option("--store", store_,
                   "s3://BUCKET/PREFIX?endpoint=URL&region=NAME (keys in $AWS_ACCESS_KEY_ID and "
                   "$AWS_SECRET_ACCESS_KEY), http(s)://HOST/PATH, or a folder [$SCANLOC_STORE]")
        ->envname("SCANLOC_STORE")
        ->type_name("URL")
        ->required();
    app.add_option("--region", region_, "Name by which robots ask for it")->required();
    app.add_option(
           "--area", area_,
           "Where it is, by which queries with a place on earth are led to it and neighbours "
           "are found: corners, two of a box or all of a polygon, in longitude and latitude, "
           "or in metres of a map that does not know where on earth it stands; or a file with "
           "a GeoJSON polygon [the convex hull of its places]")
        ->type_name("X,Y,X,Y,...|FILE");
    app.add_option("--by", by_, "Who publishes it [login name]");
    app.footer(
        "The map is verified first. It is in force once this has ended well; else, and while it\n"
        "runs, the one before is.\n"
        "Example:\n"
        "  scanloc publish town.scanloc --region town --store /srv/store \\\n"
        "      --catalogue postgresql://scanloc@db/maps");
  }

  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const Version version, Look());
    RETURN_IF_ERROR(Validate(version));
    ASSIGN_OR_RETURN(const std::unique_ptr<Catalogue> opened, catalogue::OpenCatalogue(catalogue_));
    ASSIGN_OR_RETURN(const std::unique_ptr<catalogue::Store> store, catalogue::OpenStore(store_));
    // First the file, then the word that it is there: what is interrupted leaves nothing in force.
    absl::Status status = store->Put(version.FileName(), map_);
    if (status.ok()) status = opened->Publish(version);
    if (!status.ok()) return status;
    return WriteText("-", absl::StrFormat("published %s as region %s\n"
                                          "  content id  %s\n"
                                          "  file        %s\n",
                                          Printable(map_), Printable(region_), version.content_id,
                                          version.FileName()));
  }

 private:
  [[nodiscard]] absl::StatusOr<Version> Look() const {
    ASSIGN_OR_RETURN(const mapdb::FileInfo info, mapdb::ReadInfo(map_));
    if (!info.complete) {
      return absl::FailedPreconditionError(
          absl::StrCat("map '", map_, "' is incomplete; finish its build with --resume first"));
    }
    ASSIGN_OR_RETURN(const std::vector<std::string> problems, mapdb::FindProblems(map_));
    if (!problems.empty()) {
      return absl::DataLossError(absl::StrCat("map '", map_, "' is damaged: ", problems.front(),
                                              "; scanloc verify tells more"));
    }
    ASSIGN_OR_RETURN(std::string sha256, catalogue::Sha256OfFile(map_));
    Version version{.region = region_,
                    .content_id = info.content_id,
                    .sha256 = std::move(sha256),
                    .num_bytes = info.file_bytes,
                    .num_places = info.num_places,
                    .area = {},
                    .published_by = by_.empty() ? LoginName() : by_};
    ASSIGN_OR_RETURN(version.area, AreaOf(info));
    return version;
  }

  /// As given, else round the places.
  [[nodiscard]] absl::StatusOr<Area> AreaOf(const mapdb::FileInfo& info) const {
    if (!area_.empty()) return GivenArea(info.geo_origin.has_value());
    ASSIGN_OR_RETURN(const std::vector<mapdb::PlaceRecord> places, mapdb::ReadPlaces(map_));
    if (places.empty()) return Area();
    std::vector<Corner> corners;
    for (const mapdb::PlaceRecord& record : places) {
      const Eigen::Vector3d at = record.place.T_map_place.translation();
      corners.push_back({at.x(), at.y()});
    }
    Area area{.corners = catalogue::ConvexHull(std::move(corners)), .is_on_earth = false};
    if (!info.geo_origin) return area;
    ASSIGN_OR_RETURN(const geo::GeoFrame frame, geo::GeoFrame::Create(*info.geo_origin));
    area.is_on_earth = true;
    for (Corner& corner : area.corners) {
      const geo::GeoPosition at = frame.ToGeo(Eigen::Vector3d(corner.x, corner.y, 0.0));
      corner = {at.longitude_deg, at.latitude_deg};
    }
    return area;
  }

  [[nodiscard]] absl::StatusOr<Area> GivenArea(bool is_on_earth) const {
    std::vector<double> numbers;
    for (const absl::string_view part : absl::StrSplit(area_, ',')) {
      double number = 0.0;
      if (!absl::SimpleAtod(part, &number)) {
        constexpr std::int64_t kMostBytes = 16 << 20;
        const absl::StatusOr<std::string> text = ReadFile(area_, kMostBytes);
        if (text.ok()) return catalogue::AreaFromGeoJson(*text);
        return absl::NotFoundError(absl::StrCat("--area is neither a list of numbers nor a file: ",
                                                text.status().message()));
      }
      numbers.push_back(number);
    }
    if (numbers.size() % 2 != 0 || numbers.size() < 4) {
      return absl::InvalidArgumentError(
          absl::StrCat("--area has ", numbers.size(),
                       " numbers; it takes X,Y of two opposite corners of a box, or of each corner "
                       "of a polygon"));
    }
    Area area{.corners = {}, .is_on_earth = is_on_earth};
    for (std::size_t i = 0; i < numbers.size(); i += 2) {
      area.corners.push_back({numbers[i], numbers[i + 1]});
    }
    if (area.corners.size() == 2) area.corners = catalogue::CornersOf(catalogue::BoxOf(area));
    return area;
  }

  std::string map_, catalogue_, store_, region_, by_, area_;
};

class RollbackCommand : public Command {
 public:
  RollbackCommand()
      : Command("rollback", "Put an earlier map of a region in force again, or none") {}
  void Declare(CLI::App& app) override {
    app.add_option("REGION", region_, "Name of the region")->required();
    AddCatalogueOption(app, &catalogue_);
    auto* to = app.add_option("--to", content_id_,
                              "Content id of the version [that published before the one in force]");
    app.add_flag("--withdraw", withdraw_, "No version: the region is not answered for any more")
        ->excludes(to);
  }
  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const std::unique_ptr<Catalogue> opened, catalogue::OpenCatalogue(catalogue_));
    if (withdraw_) {
      RETURN_IF_ERROR(opened->Withdraw(region_));
      return WriteText("-", absl::StrCat("region ", Printable(region_), " is withdrawn\n"));
    }
    ASSIGN_OR_RETURN(const Version now, opened->Rollback(region_, content_id_));
    return WriteText("-", LineOf(now, true));
  }

 private:
  std::string region_, catalogue_, content_id_;
  bool withdraw_ = false;
};

class CatalogueCommand : public Command {
 public:
  CatalogueCommand()
      : Command("catalogue", "Tell which maps are in force, or all that a region ever had") {}
  void Declare(CLI::App& app) override {
    app.add_option("REGION", region_, "All versions of this region [those in force, of all]");
    AddCatalogueOption(app, &catalogue_);
    app.add_flag("--json", json_, "Print JSON");
  }
  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const std::unique_ptr<Catalogue> opened, catalogue::OpenCatalogue(catalogue_));
    const absl::StatusOr<std::vector<Version>> live = opened->Live();
    if (!live.ok()) return live.status();
    ASSIGN_OR_RETURN(const std::vector<Version> told,
                     region_.empty() ? live : opened->History(region_));
    // Of versions that are alike in all, the one published last.
    std::vector<Version> left = *live;
    nlohmann::json json = nlohmann::json::array();
    std::string text;
    for (const Version& version : told) {
      const auto found = std::ranges::find(left, version);
      const bool is_live = found != left.end();
      if (is_live) left.erase(found);
      json.push_back(ToJson(version, is_live));
      text += LineOf(version, is_live);
    }
    if (told.empty() && !json_) {
      std::fprintf(stderr, "%s\n",
                   region_.empty()
                       ? "no map is in force"
                       : absl::StrCat("region ", Printable(region_), " never had a map").c_str());
    }
    return WriteText("-", json_ ? absl::StrCat(json.dump(2), "\n") : text);
  }

 private:
  std::string region_, catalogue_;
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> MakePublishCommand() { return std::make_unique<PublishCommand>(); }
std::unique_ptr<Command> MakeRollbackCommand() { return std::make_unique<RollbackCommand>(); }
std::unique_ptr<Command> MakeCatalogueCommand() { return std::make_unique<CatalogueCommand>(); }

}  // namespace scanloc::cli
