#include "cli/param_options.hpp"

#include <CLI/CLI.hpp>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "cli/command.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::cli {
namespace {

constexpr const char* kGroup = "Parameters of the map (fixed when it is made)";

absl::Status ParseDescriptors(const std::string& text, Params* params) {
  params->polar.enabled = false;
  params->cart.enabled = false;
  for (const absl::string_view kind : absl::StrSplit(text, ',')) {
    if (kind == "pc") {
      params->polar.enabled = true;
    } else if (kind == "cc") {
      params->cart.enabled = true;
    } else {
      return absl::InvalidArgumentError(
          absl::StrCat("--descriptors is \"", text, "\"; use pc, cc or pc,cc"));
    }
  }
  return absl::OkStatus();
}

absl::Status ParseRootShifts(const std::string& text, Params* params) {
  params->polar.root_shifts_m.clear();
  for (const absl::string_view part : absl::StrSplit(text, ',', absl::SkipWhitespace())) {
    double shift_m = 0.0;
    if (!absl::SimpleAtod(part, &shift_m)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "--root-shifts-m is \"", text, "\"; use metres with commas between, for example 2,-2"));
    }
    params->polar.root_shifts_m.push_back(shift_m);
  }
  return absl::OkStatus();
}

absl::Status ParseScale(const std::string& text, Params* params) {
  double scale = 0.0;
  if (!absl::SimpleAtod(text, &scale) || !(scale >= kMinScale && scale <= kMaxScale)) {
    return absl::InvalidArgumentError(absl::StrCat("--scale is \"", text,
                                                   "\"; use auto or a number in [", kMinScale, ", ",
                                                   kMaxScale, "], for example 0.35 for rooms"));
  }
  params->automatic = AutoParamsAtScale(scale);
  return absl::OkStatus();
}

}  // namespace

void ParamOptions::Declare(CLI::App& app) {
  app_ = &app;
  const OptionGroup group(app, kGroup);
  app.add_option(
      "--descriptors", descriptors_,
      "Contexts that the map holds: pc (polar), cc (cart) or both; a map with both serves all "
      "methods");
  app.add_flag("--no-augment", no_augment_,
               "No augmentation: neither root shifts (a-pc) nor the double flip (a-cc)");
  app.add_flag("--keep-scans,!--no-keep-scans", params_.structure.enabled,
               "Keep the upright structure of every scan, 1 to 5 kB each, which auto needs "
               "[yes]");
  app.add_option(
      "--scale", scale_,
      "Of the lengths by which auto sees a scene: a number, 1 for streets and 0.35 for rooms, or "
      "auto "
      "to learn it from the scans");
  app.add_option("--voxel-size-m", params_.voxel_size_m, "Edge of the voxels that thin a scan [m]");
  app.add_option("--sensor-height-m", params_.sensor_height_m,
                 "Height of the sensor above the ground, in [0, 10] [m]")
      ->check(InRange(0.0, 10.0));
  app.add_option("--polar-rings", params_.polar.num_rings, "Rows of the polar context");
  app.add_option("--polar-sectors", params_.polar.num_sectors,
                 "Columns of the polar context, even");
  app.add_option("--polar-range-m", params_.polar.max_range_m,
                 "Range that the polar context covers [m]");
  app.add_option("--root-shifts-m", root_shifts_m_,
                 "Lateral positions of the virtual vehicles of a-pc, +y is left [m]");
  app.add_option("--cart-rows", params_.cart.num_rows, "Rows of the cart context, along x; even");
  app.add_option("--cart-cols", params_.cart.num_cols,
                 "Columns of the cart context, along y; even");
  app.add_option("--cart-x-m", params_.cart.max_x_m, "The cart context covers x up to ± this [m]");
  app.add_option("--cart-y-m", params_.cart.max_y_m, "The cart context covers y up to ± this [m]");
  app.add_option(
         "--cart-shift-mode", cart_shift_mode_,
         "What becomes of columns that are shifted out: bounded (lost) or circular (come in again)")
      ->check(CLI::IsMember({"bounded", "circular"}));
  app.add_option("--cart-max-shift-cols", params_.cart.max_shift_cols,
                 "Farthest lateral shift that is tried, in columns; bounded only");
  app.add_option("--candidates", params_.search.num_candidates,
                 "Places taken from the k-d tree for a query that does not say");
  app.add_option("--align-radius", params_.search.align_radius,
                 "Columns tried on either side of the pre-aligned shift");
  app.add_option("--polar-threshold", params_.search.polar_threshold,
                 "Distance up to which pc and a-pc recognise a place, in [0, 1]");
  app.add_option("--cart-threshold", params_.search.cart_threshold,
                 "Distance up to which cc and a-cc recognise a place, in [0, 1]");
  app.add_option("--min-confidence", params_.search.min_confidence,
                 "Least confidence at which auto answers localized, in [0.01, 0.999]");
  app.add_option("--min-voxels", params_.search.min_voxels,
                 "A query with fewer voxels in range is answered insufficient_scan");
}

bool ParamOptions::given() const {
  return !app_->get_options([](const CLI::Option* option) {
                return option->get_group() == kGroup && option->count() > 0;
              })
              .empty();
}

absl::StatusOr<Params> ParamOptions::Make() const {
  Params params = params_;
  RETURN_IF_ERROR(ParseDescriptors(descriptors_, &params));
  RETURN_IF_ERROR(ParseRootShifts(root_shifts_m_, &params));
  if (!learns_scale()) {
    RETURN_IF_ERROR(ParseScale(scale_, &params));
  }
  params.cart.shift_mode =
      cart_shift_mode_ == "bounded" ? ShiftMode::kBounded : ShiftMode::kCircular;
  if (no_augment_) {
    params.polar.root_shifts_m.clear();
    params.cart.double_flip = false;
  }
  RETURN_IF_ERROR(Validate(params));
  return params;
}

}  // namespace scanloc::cli
