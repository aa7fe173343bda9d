#pragma once

#include <CLI/App.hpp>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "scanloc/core/params.hpp"

namespace scanloc::cli {

/// The parameters of a map as options of the command line.
class ParamOptions {
 public:
  /// Declares one option a parameter, with its default.
  void Declare(CLI::App& app);

  /// Whether any of them was given.
  [[nodiscard]] bool given() const;

  /// InvalidArgument: out of range, or text that does not parse.
  [[nodiscard]] absl::StatusOr<Params> Make() const;

  /// Whether the scale is to be learned from the scans; those of Make() are then of scale 1.
  [[nodiscard]] bool learns_scale() const { return scale_ == kLearnedScale; }

 private:
  static constexpr const char* kLearnedScale = "auto";

  Params params_;
  std::string descriptors_ = "pc,cc";
  std::string root_shifts_m_ = "2,-2";
  std::string cart_shift_mode_ = "bounded";
  std::string scale_ = kLearnedScale;
  bool no_augment_ = false;
  const CLI::App* app_ = nullptr;
};

}  // namespace scanloc::cli
