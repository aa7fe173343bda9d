#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scanloc/core/map/bearing_table.hpp"
#include "scanloc/core/map/context_table.hpp"
#include "scanloc/core/map/geo_origin.hpp"
#include "scanloc/core/map/payload.hpp"
#include "scanloc/core/params.hpp"
#include "scanloc/core/scan/bearing_grid.hpp"
#include "scanloc/core/scan/pose.hpp"

namespace scanloc {

/// One place of a map: where the sensor stood when it was mapped.
struct Place {
  Pose T_map_place = Pose::Identity();
  std::int64_t stamp_ns = 0;  ///< when it was mapped; 0 if the drive has no times
  std::int32_t session = 0;   ///< index into Map::sessions
};

/// The ground at a place, and whether the place has posts at all.
struct PlaceGround {
  Ground ground;
  bool has_posts = false;

  friend bool operator==(const PlaceGround&, const PlaceGround&) = default;
};

/// That a map was looked through for places that would be taken for each other; see calibrate.hpp.
/// The weights are of a confidence that was once fitted to each map: map files of schema 2 have
/// them, and nothing uses them.
struct Calibration {
  double bias = -9.0;
  double score_weight = 10.0;
  double margin_weight = 25.0;
  std::int32_t num_trials = 0;  ///< with the map's own places; 0: not looked through, too few

  friend bool operator==(const Calibration&, const Calibration&) = default;
};

/// Two places far from each other that look alike.
struct ConfusablePair {
  std::int32_t place = 0;
  std::int32_t lookalike = 0;
  /// That the look-alike would be given were the place itself not in the map.
  double confidence = 0.0;

  friend bool operator==(const ConfusablePair&, const ConfusablePair&) = default;
};

/// A map: all that answering a query needs. Read-only once made.
///
/// Contexts and structures are in memory, or stay in a file, from where a search reads those of its
/// candidates (`payload`); the answers are the same, bit for bit.
struct Map {
  Params params;
  std::string content_id;             ///< hash over what the map says; traces an answer to its map
  std::vector<std::string> sessions;  ///< names
  std::vector<Place> places;          ///< in the order built
  ContextTable polar;                 ///< empty where the map has no polar contexts
  ContextTable cart;
  std::vector<Structure> structures;  ///< one a place; empty where there are none, or in a file
  std::vector<PlaceGround> grounds;   ///< one a place; empty where the map has no structures
  BearingTable bearings;              ///< likewise; BearingsOf each place's posts
  /// Null: contexts and structures are in memory. Else the tables hold retrieval keys alone.
  std::shared_ptr<const PayloadReader> payload;
  Calibration calibration;
  std::vector<ConfusablePair> confusable;  ///< worst first
  /// Hash over calibration and confusable, empty for the defaults: maps of one content id and one
  /// calibration id give the same answers.
  std::string calibration_id;
  std::optional<GeoOrigin> geo_origin;  ///< where on earth its frame stands, if that was told
  bool complete = true;  ///< false: its build was stopped; places are missing at its end

  /// Appends the contexts, augmented ones included, and the structure of the next place. Requires
  /// Validate(descriptor, params).ok() and tables of the parameters' shapes.
  void AppendDescriptor(std::int32_t place, const PlaceDescriptor& descriptor);
  /// The structure alone, and its ground.
  void AppendStructure(Structure structure);

  /// Holds keys and bearings of another map in place of its own that are equal, by the block
  /// (SharedBlocks), among those appended since the last call; costs next to nothing where no block
  /// became full since.
  void ShareWith(const Map& other);
};

/// How a place's posts stand around it, a sector wider to either side than they are.
[[nodiscard]] BearingGrid BearingsOf(std::span<const Post> posts, const Params& params);

/// A map without places, with tables of the right shapes.
[[nodiscard]] Map MakeEmptyMap(const Params& params);

}  // namespace scanloc
