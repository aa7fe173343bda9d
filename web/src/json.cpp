#include "json.hpp"

#include <cmath>

#include "scanloc/proto/map_state.hpp"

namespace scanloc::web {
namespace {

Json Vector(const Eigen::Vector3d& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

Json ContextToJson(const Context& context) {
  if (context.empty()) return nullptr;
  return {{"num_rows", context.num_rows},
          {"num_cols", context.num_cols},
          {"cells_cm", context.cells_cm}};
}

}  // namespace

Json ToJson(const MapSummary& map) {
  return {{"name", map.name},
          {"state", StateName(map.state)},
          {"content_id", map.content_id},
          {"num_places", map.num_places},
          {"generation", map.generation}};
}

Json ToJson(const MapInfo& info) {
  Json json{{"name", info.name},
            {"content_id", info.content_id},
            {"num_places", info.num_places},
            {"generation", info.generation},
            {"sessions", info.sessions},
            {"extent", nullptr},
            {"min_confidence", info.params.search.min_confidence},
            {"polar_max_range_m", info.params.polar.max_range_m},
            {"cart_max_x_m", info.params.cart.max_x_m},
            {"cart_max_y_m", info.params.cart.max_y_m}};
  if (info.geo_origin) json["geo_origin"] = report::GeoToJson(*info.geo_origin);
  if (info.extent) {
    json["extent"] = {{"min", Vector(info.extent->min_m)}, {"max", Vector(info.extent->max_m)}};
  }
  return json;
}

Json ToJson(const PlacesPage& page) {
  Json json{{"content_id", page.content_id},
            {"places", Json::array()},
            {"next_page_token", page.next_page_token}};
  for (std::size_t i = 0; i < page.places.size(); ++i) {
    const Place& place = page.places[i];
    Json row{{"place", page.first_place + static_cast<std::int32_t>(i)},
             {"session", place.session},
             {"stamp_ns", place.stamp_ns},
             {"T_map_place", report::PoseToJson(place.T_map_place)}};
    if (!page.geo.empty()) row["geo"] = report::GeoToJson(page.geo[i]);
    json["places"].push_back(std::move(row));
  }
  return json;
}

Json ToJson(std::int32_t index, const PlaceDetails& details) {
  Json json{{"content_id", details.content_id},
            {"place", index},
            {"session", details.place.session},
            {"stamp_ns", details.place.stamp_ns},
            {"T_map_place", report::PoseToJson(details.place.T_map_place)},
            {"polar", ContextToJson(details.descriptor.polar)},
            {"cart", ContextToJson(details.descriptor.cart)},
            {"posts_cm", PostsToJson(details.descriptor.structure)}};
  if (details.geo) json["geo"] = report::GeoToJson(*details.geo);
  return json;
}

Json ToJson(const ConfusablePairs& pairs, const PlaceTiles& tiles) {
  Json json{{"content_id", pairs.content_id}, {"pairs", Json::array()}};
  const auto is_known = [&tiles](std::int32_t place) {
    return place >= 0 && static_cast<std::size_t>(place) < tiles.num_places();
  };
  for (const ConfusablePair& pair : pairs.pairs) {
    if (!is_known(pair.place) || !is_known(pair.lookalike)) continue;
    json["pairs"].push_back({{"place", pair.place},
                             {"lookalike", pair.lookalike},
                             {"confidence", pair.confidence},
                             {"from", Vector(tiles.Position(pair.place))},
                             {"to", Vector(tiles.Position(pair.lookalike))}});
  }
  return json;
}

Json ToJson(const PlaceTiles& tiles) {
  Json json{{"content_id", tiles.content_id()},
            {"num_places", tiles.num_places()},
            {"origin", Vector(tiles.origin_m())},
            {"first_stamp_ns", tiles.first_stamp_ns()},
            {"row_bytes", PlaceTiles::kRowBytes},
            {"floors", Json::array()},
            {"tiles", Json::array()}};
  for (const PlaceTiles::Floor& floor : tiles.floors()) {
    json["floors"].push_back(
        {{"min_z_m", floor.min_z_m}, {"max_z_m", floor.max_z_m}, {"count", floor.count}});
  }
  for (const PlaceTiles::Tile& tile : tiles.tiles()) {
    json["tiles"].push_back({{"level", tile.level},
                             {"x", tile.min_x_m},
                             {"y", tile.min_y_m},
                             {"side", tile.side_m},
                             {"count", tile.count}});
  }
  return json;
}

Json ToJson(const LocalizeReply& reply) {
  Json json{{"map", reply.map}, {"content_id", reply.answer.content_id}};
  json.update(report::AnswerToJson(reply.answer));
  json["stamp_ns"] = reply.header.stamp_ns;
  json["frame_id"] = reply.header.frame_id;
  return json;
}

Json ToJson(const SeenAnswer& answer) {
  return {{"number", answer.number},
          {"answered_ns", answer.answered_ns},
          {"request_id", answer.request_id},
          {"client", answer.client},
          {"is_of_stream", answer.is_of_stream},
          {"answer", ToJson(answer.reply)},
          {"posts_cm", PostsToJson(answer.structure, answer.T_query_structure)}};
}

Json PostsToJson(const Structure& structure, const Pose& T_frame_structure) {
  Json posts = Json::array();
  for (const Post& post : structure.posts) {
    const Eigen::Vector3d at =
        T_frame_structure * Eigen::Vector3d(post.x_cm / 100.0, post.y_cm / 100.0, 0.0);
    posts.push_back(std::lround(at.x() * 100.0));
    posts.push_back(std::lround(at.y() * 100.0));
  }
  return posts;
}

std::string ToLine(const Json& json) {
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

}  // namespace scanloc::web
