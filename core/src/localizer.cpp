#include "scanloc/core/localizer.hpp"

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "map/narrowing.hpp"
#include "scan_context/locate.hpp"
#include "scanloc/core/map/up.hpp"
#include "structural/auto_search.hpp"
#include "structural/locate.hpp"

namespace scanloc {

absl::Status Localizer::Prepare(const std::optional<Method>& only, const DoAll& do_all,
                                const Localizer* before) {
  const Params& params = map_->params;
  if (absl::Status status = Validate(params); !status.ok()) return status;
  const std::size_t num_structures = params.structure.enabled ? map_->places.size() : 0;
  if (map_->grounds.size() != num_structures) {
    return absl::InvalidArgumentError(
        absl::StrFormat("the map has %d structures; its parameters ask for %d",
                        map_->grounds.size(), num_structures));
  }
  const auto is_wanted = [&](DescriptorKind kind) {
    return !only || (!only->automatic && only->kind == kind);
  };
  const absl::StatusOr<Eigen::Vector3d> up = FindUp(*map_);
  if (!up.ok()) return up.status();
  std::vector<std::function<void()>> indexes;  // the one that takes longest first
  if (params.structure.enabled && (!only || only->automatic)) {
    indexes.emplace_back([&] {
      auto_search_ = std::make_shared<AutoSearch>(
          *map_, *up, before == nullptr ? nullptr : before->auto_search_.get());
    });
  }
  if (params.polar.enabled && is_wanted(DescriptorKind::kPolar)) {
    indexes.emplace_back([&] {
      polar_search_ = std::make_shared<ContextSearch>(
          *map_, DescriptorKind::kPolar, before == nullptr ? nullptr : before->polar_search_.get());
    });
  }
  if (params.cart.enabled && is_wanted(DescriptorKind::kCart)) {
    indexes.emplace_back([&] {
      cart_search_ = std::make_shared<ContextSearch>(
          *map_, DescriptorKind::kCart, before == nullptr ? nullptr : before->cart_search_.get());
    });
  }
  if (do_all) return do_all(indexes);
  for (const auto& index : indexes) index();
  return absl::OkStatus();
}

absl::Status Localizer::Extend() {
  if (polar_search_) polar_search_->Extend();
  if (cart_search_) cart_search_->Extend();
  if (!auto_search_) return absl::OkStatus();
  const absl::StatusOr<Eigen::Vector3d> up = FindUp(*map_);
  auto_search_->Extend(up.ok() ? *up : auto_search_->up());
  return up.status();
}

absl::StatusOr<std::shared_ptr<const Localizer>> Localizer::Create(std::shared_ptr<const Map> map,
                                                                   const DoAll& do_all,
                                                                   const Localizer* before) {
  std::shared_ptr<Localizer> localizer(new Localizer(std::move(map)));
  if (absl::Status status = localizer->Prepare(std::nullopt, do_all, before); !status.ok()) {
    return status;
  }
  return localizer;
}

absl::StatusOr<std::shared_ptr<const Localizer>> Localizer::CreateFor(
    std::shared_ptr<const Map> map, const Method& method) {
  std::shared_ptr<Localizer> localizer(new Localizer(std::move(map)));
  if (absl::Status status = localizer->Prepare(method); !status.ok()) return status;
  return localizer;
}

absl::Status Localizer::Check(const ScanDescriptor& scan, const Query& query,
                              const SearchControl& control) const {
  if (absl::Status status = Validate(query, map_->params); !status.ok()) return status;
  if (control.excluded != nullptr && control.excluded->size() != map_->places.size()) {
    return absl::InvalidArgumentError(
        absl::StrFormat("excluded has %d elements; the map has %d places", control.excluded->size(),
                        map_->places.size()));
  }
  return Validate(scan, map_->params);
}

absl::StatusOr<Answer> Localizer::Localize(const ScanDescriptor& scan, const Query& query,
                                           const SearchControl& control) const {
  if (absl::Status status = Check(scan, query, control); !status.ok()) return status;
  SearchControl within = control;
  absl::StatusOr<Narrowing> narrowing = Narrowing{.num_places = map_->places.size()};
  if (!query.prior.is_open()) {
    narrowing = Narrow(*map_, query.prior, control.excluded);
    if (!narrowing.ok()) return narrowing.status();
    within.excluded = &narrowing->excluded;
  }
  const Params& params = map_->params;
  const Method method = MethodOf(query, params);
  const ContextSearch* const by_context =
      (method.kind == DescriptorKind::kPolar ? polar_search_ : cart_search_).get();
  if (method.automatic ? auto_search_ == nullptr : by_context == nullptr) {
    return absl::FailedPreconditionError("the localizer was made for another method");
  }
  Answer answer;
  if (scan.num_voxels < static_cast<std::uint32_t>(params.search.min_voxels)) {
    answer.outcome = Outcome::kInsufficientScan;
    answer.reason = absl::StrFormat("the scan has %d occupied voxels in range; %d are needed",
                                    scan.num_voxels, params.search.min_voxels);
  } else if (narrowing->num_places == 0 && !query.prior.is_open()) {
    answer.reason = "no place of the map lies where the prior says";
  } else if (method.automatic) {
    absl::StatusOr<Answer> located = LocateByStructure(*map_, *auto_search_, scan, query, within);
    if (!located.ok()) return located.status();
    answer = *std::move(located);
  } else {
    absl::StatusOr<Answer> located = by_context->Locate(scan, query, within);
    if (!located.ok()) return located.status();
    answer = *std::move(located);
  }
  if (control.IsUnwanted()) return absl::CancelledError("nobody waits for the answer any more");
  if (!map_->complete)
    answer.reason += "; the map is half built: its drive has places that it lacks";
  answer.content_id = map_->content_id;
  return answer;
}

}  // namespace scanloc
