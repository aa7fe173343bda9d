#include "rpc/viewer_service.hpp"

#include "maps/use_book.hpp"
#include "rpc/small_call.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/proto/convert.hpp"
#include "scanloc/proto/convert_viewer.hpp"

namespace scanloc::server {
namespace {

absl::StatusOr<std::shared_ptr<const ServedMap>> FindMap(const MapRegistry& maps,
                                                         const std::string& name) {
  RETURN_IF_ERROR(proto::CheckAskedMap(name));
  return maps.Find(name);
}

}  // namespace

ViewerService::ViewerService(const MapRegistry& maps, const RecentAnswers& answers,
                             const CallWaits& waits, Admission& admission)
    : maps_(maps), answers_(answers), waits_(waits), admission_(admission) {
  Offer<v1::GetPlaceRequest>(
      "/scanloc.v1.Viewer/GetPlace", "GetPlace", Role::kQuery,
      [this](const v1::GetPlaceRequest& message) -> absl::StatusOr<v1::GetPlaceResponse> {
        ASSIGN_OR_RETURN(const auto map, FindMap(maps_, message.map()));
        ASSIGN_OR_RETURN(auto details, DetailsOf(map->localizer->map(), message.place()));
        if (map->geo) details.geo = map->geo->ToGeo(details.place.T_map_place);
        return proto::ToProto(details);
      });
  Offer<v1::ListConfusablePairsRequest>(
      "/scanloc.v1.Viewer/ListConfusablePairs", "ListConfusablePairs", Role::kQuery,
      [this](const v1::ListConfusablePairsRequest& message)
          -> absl::StatusOr<v1::ListConfusablePairsResponse> {
        ASSIGN_OR_RETURN(const auto map, FindMap(maps_, message.map()));
        const Map& held = map->localizer->map();
        return proto::ToProto(ConfusablePairs{held.content_id, held.confusable});
      });
  Offer<v1::ListPlaceUseRequest>(
      "/scanloc.v1.Viewer/ListPlaceUse", "ListPlaceUse", Role::kView,
      [this](const v1::ListPlaceUseRequest& message) -> absl::StatusOr<v1::ListPlaceUseResponse> {
        ASSIGN_OR_RETURN(const auto map, FindMap(maps_, message.map()));
        if (map->use == nullptr) {
          return absl::UnimplementedError(
              "the server does not count how its maps fare; start it without "
              "--map-health-seconds 0");
        }
        ASSIGN_OR_RETURN(const auto page,
                         map->use->Page(message.first_place(), message.max_places()));
        return proto::ToProto(page);
      });
  Offer<v1::ListAnswersRequest>(
      "/scanloc.v1.Viewer/ListAnswers", "ListAnswers", Role::kView,
      [this](const v1::ListAnswersRequest& message) -> absl::StatusOr<v1::ListAnswersResponse> {
        RETURN_IF_ERROR(proto::CheckAskedMap(message.map()));
        if (answers_.is_on()) return answers_.List(message);
        return absl::UnimplementedError(
            "the server keeps no answers to look at; start it with --recent-answers");
      });
}

template <typename Request, typename Act>
void ViewerService::Offer(const char* path, const char* method, Role role, Act act) {
  Serve(path, [this, method, role, act](grpc::CallbackServerContext* context) {
    return AnswerHere<Request>(waits_, admission_, method, role, context, act);
  });
}

}  // namespace scanloc::server
