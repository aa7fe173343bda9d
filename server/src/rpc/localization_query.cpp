// What the LocalizationService says to one query, of one map or of all.
#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "maps/use_book.hpp"
#include "ops/clock.hpp"
#include "rpc/localization_service.hpp"
#include "scanloc/core/among_maps.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/status.hpp"

namespace scanloc::server {
namespace {

/// Half of the places that the method auto verifies where nobody says how many.
constexpr int kAutoCandidates = 100;

using ServedMaps = std::vector<std::shared_ptr<const ServedMap>>;

/// Whether several maps can be asked one question whose answers can be compared.
absl::Status CheckComparable(const ServedMaps& maps, const Query& query) {
  if (maps.size() == 1) return absl::OkStatus();
  Prior of_one_map = query.prior;
  of_one_map.on_earth.reset();
  if (!of_one_map.is_open()) {
    return absl::InvalidArgumentError(
        "options.prior goes with the name of a map, whose coordinates and sessions it tells; of "
        "several maps only on_earth");
  }
  const ServedMap& first = *maps.front();
  const Method method = MethodOf(query, first.info.params);
  for (const auto& map : maps) {
    if (MethodOf(query, map->info.params) == method) continue;
    return proto::WithReason(
        v1::ERROR_REASON_METHOD_NOT_SERVED,
        absl::FailedPreconditionError(
            absl::StrCat("the request names neither a map nor a method, and maps ", first.info.name,
                         " and ", map->info.name, " answer by different ones, ", MethodName(method),
                         " and ", MethodName(MethodOf(query, map->info.params)), "; name either")));
  }
  return absl::OkStatus();
}

/// The prior as a map takes it. One that does not know where on earth it stands is looked at as a
/// whole, if others do.
absl::StatusOr<Prior> PriorOf(const ServedMaps& maps, const ServedMap& map, const Prior& asked) {
  const bool does_any_know =
      std::ranges::any_of(maps, [](const auto& other) { return other->geo.has_value(); });
  if (!asked.on_earth || map.geo || !does_any_know) return geo::InMapFrame(asked, map.geo);
  return Prior{};
}

/// Each candidate by the map that it is in, which it names where several were asked.
void TellWhereOnEarth(const ServedMaps& maps, Answer& answer) {
  for (Candidate& candidate : answer.candidates) {
    const auto map = std::ranges::find_if(maps, [&](const auto& asked) {
      return candidate.map.empty() || candidate.map == asked->info.name;
    });
    if (map != maps.end() && (*map)->geo) {
      candidate.geo = (*map)->geo->ToGeo(candidate.T_map_query);
    }
  }
}

using DescribedBySignature = std::map<std::string, QueryDescriber::Described>;

absl::StatusOr<std::vector<MapAnswer>> AskEach(
    const ServedMaps& maps, const DescribedBySignature& described, const Query& asked,
    int max_candidates, SearchControl control,
    const std::function<absl::Status(const absl::Status&, const ServedMap&)>& error_of) {
  const std::int64_t end_ns = control.deadline_ns;
  std::vector<MapAnswer> answers;
  for (const auto& map : maps) {
    // What is left of the budget is shared by the maps that are left.
    if (const std::int64_t now_ns = NowNs(); end_ns > now_ns) {
      const auto num_left = static_cast<std::int64_t>(maps.size() - answers.size());
      control.deadline_ns = now_ns + (end_ns - now_ns) / num_left;
    }
    Query query = asked;
    LimitCandidates(map->info.params, max_candidates, query);
    ASSIGN_OR_RETURN(query.prior, PriorOf(maps, *map, asked.prior));
    const ScanDescriptor& descriptor = described.at(map->signature).descriptor;
    auto answer = map->localizer->Localize(descriptor, query, control);
    if (!answer.ok()) return error_of(answer.status(), *map);
    answers.push_back({.map = map->info.name,
                       .params = map->info.params,
                       .num_posts = descriptor.structure.posts.size(),
                       .answer = *std::move(answer)});
  }
  return answers;
}

}  // namespace

void LimitCandidates(const Params& params, int max_candidates, Query& query) {
  if (query.num_candidates) return;
  const bool is_auto = MethodOf(query, params).automatic;
  const int of_map = is_auto ? kAutoCandidates : params.search.num_candidates;
  if (of_map > max_candidates) query.num_candidates = max_candidates;
}

absl::StatusOr<LocalizationService::Asked> LocalizationService::AskedBy(
    const v1::LocalizeRequest& request) const {
  ASSIGN_OR_RETURN(auto query, proto::FromProto(request.options()));
  RETURN_IF_ERROR(CheckCost(query));
  ASSIGN_OR_RETURN(const auto budget, proto::BudgetFromProto(request.options()));
  return Asked{std::move(query), budget};
}

absl::Status LocalizationService::CheckCost(const Query& query) const {
  const int most = std::max(query.num_candidates.value_or(1), query.max_answers);
  if (most > limits_.max_candidates) {
    return proto::WithReason(
        v1::ERROR_REASON_TOO_MANY_CANDIDATES,
        absl::ResourceExhaustedError(absl::StrCat(
            most, " candidates are asked for; this server allows ", limits_.max_candidates)));
  }
  const bool is_slow = query.method && (query.method->brute_force || query.method->naive_alignment);
  if (is_slow && !limits_.allow_slow_methods) {
    return proto::WithReason(
        v1::ERROR_REASON_METHOD_NOT_ALLOWED,
        absl::PermissionDeniedError(absl::StrCat(
            "the method ", MethodName(*query.method), " takes a thread for up to seconds; leave ",
            "out -brute and -naive, or start the server with --allow-slow-methods")));
  }
  return absl::OkStatus();
}

absl::Status LocalizationService::ErrorOf(const absl::Status& failed, const ServedMap& map) const {
  if (!absl::IsDataLoss(failed)) return failed;
  found_damage_(map, failed);
  return proto::WithReason(v1::ERROR_REASON_MAP_FAILED,
                           absl::UnavailableError(absl::StrCat(
                               "map ", map.info.name, " was found damaged and is out of ",
                               "service; the server's log says where")));
}

SearchControl LocalizationService::ControlOf(const grpc::CallbackServerContext& context,
                                             std::chrono::milliseconds budget) {
  SearchControl control = TimedBy(NowNs, std::chrono::nanoseconds(budget).count());
  control.is_unwanted = [&context] { return context.IsCancelled(); };
  control.run_both = &RunBoth;
  return control;
}

absl::StatusOr<LocalizeReply> LocalizationService::Answer(
    const v1::LocalizeRequest& request, const Arrival& arrival,
    const grpc::CallbackServerContext& context, QueryDescriber& describer, const Call& call) {
  RETURN_IF_ERROR(proto::CheckAskedMap(request.map()));
  ASSIGN_OR_RETURN(auto asked, AskedBy(request));
  ASSIGN_OR_RETURN(auto header, proto::HeaderFromProto(request));
  ASSIGN_OR_RETURN(const auto maps, maps_.FindAll(request.map(), asked.query.prior.on_earth));
  for (const auto& map : maps) {
    RETURN_IF_ERROR(Validate(asked.query, map->info.params));
  }
  RETURN_IF_ERROR(CheckComparable(maps, asked.query));

  const auto num_asked = static_cast<std::size_t>(asked.query.max_answers);
  if (recent_.is_on() && maps.size() == 1) {  // rivals are shown, be they asked for or not
    const int most = std::min(kMaxSeenCandidates, limits_.max_candidates);
    asked.query.max_answers = std::max(asked.query.max_answers, most);
  }
  DescribedBySignature described;
  std::int64_t describe_ns = 0;
  for (const auto& map : maps) {
    if (described.contains(map->signature)) continue;
    ASSIGN_OR_RETURN(auto as_map, describer.Describe(request, *map, limits_.max_points));
    describe_ns += as_map.describe_ns;
    described[map->signature] = std::move(as_map);
  }
  const std::int64_t decode_ns = NowNs() - arrival.started_ns - describe_ns;

  auto answers = AskEach(
      maps, described, asked.query, limits_.max_candidates, ControlOf(context, asked.budget),
      [this](const absl::Status& failed, const ServedMap& map) { return ErrorOf(failed, map); });
  if (!answers.ok()) return answers.status();
  const QueryDescriber::Described& of_scan = described.begin()->second;
  MapAnswer told = answers->size() == 1 ? std::move(answers->front())
                                        : AmongMaps(*std::move(answers), asked.query);
  told.answer.times.describe_ns = describe_ns;
  TellOfBase(of_scan.mount, told.answer);
  TellWhereOnEarth(maps, told.answer);
  LocalizeReply reply{.answer = std::move(told.answer),
                      .map = std::move(told.map),
                      .queue_ns = arrival.started_ns - arrival.arrived_ns,
                      .decode_ns = decode_ns,
                      .scan_counts = of_scan.scan_counts,
                      .header = std::move(header)};
  for (const auto& map : maps) {
    if (map->info.name == reply.map) CountUse(*map, asked.query, reply.answer, std::nullopt);
  }
  Show(reply, of_scan, call);
  if (reply.answer.candidates.size() > num_asked) reply.answer.candidates.resize(num_asked);
  return reply;
}

void LocalizationService::CountUse(const ServedMap& map, const Query& query,
                                   const scanloc::Answer& answer,
                                   std::optional<std::int32_t> last_found) {
  if (map.use == nullptr || !MethodOf(query, map.info.params).automatic) return;
  map.use->Count(answer, last_found, SinceEpochNs());
}

void LocalizationService::Show(const LocalizeReply& reply,
                               const QueryDescriber::Described& described, const Call& call) const {
  if (!recent_.is_on()) return;
  recent_.Add({.request_id = call.request_id,
               .client = call.client,
               .reply = reply,
               .structure = described.descriptor.structure,
               .T_query_structure = BaseInTurned(described.mount).inverse(),
               .is_of_stream = call.is_stream});
}

}  // namespace scanloc::server
