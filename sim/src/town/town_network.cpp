#include "town/town_network.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <utility>

namespace scanloc::sim {
namespace {

constexpr double kMeanBlock_m = 100.0;
constexpr double kSpareRoute_m = 200.0;  // the last leg is not driven to its end

struct Edge {
  int from;
  int to;
  int line;                    // streets of one line have one class and one width
  bool inner;                  // the route may take it
  std::pair<int, int> blocks;  // on both sides, each named by its first node
};

/// What all streets of one line of the grid share.
struct Line {
  StreetClass street_class;
  double lanes_half_m;
  double kerb_half_m;
  int num_lanes;
};

struct Grid {
  int side = 0;
  std::vector<Eigen::Vector2d> nodes;  // side × side
  std::vector<Line> lines;             // rows, then columns
  std::vector<Edge> edges;
  std::vector<std::vector<int>> edges_of;  // per node
};

Line MakeLine(Random& random) {
  const double kind = random.Uniform(0.0, 1.0);
  if (kind < 0.40) {
    const double lanes = random.Uniform(3.1, 3.7);
    return {StreetClass::kResidential, lanes, lanes + random.Uniform(2.5, 2.9), 1};
  }
  if (kind < 0.72) {
    const double lanes = random.Uniform(3.6, 4.6);
    return {StreetClass::kCollector, lanes, lanes + random.Uniform(2.4, 3.2), 1};
  }
  const double lanes = random.Uniform(7.0, 7.6);
  return {StreetClass::kAvenue, lanes, lanes + random.Uniform(0.4, 2.8), 2};
}

/// Drops some streets and so joins blocks. A block that the route may go round loses one street at
/// most, which keeps every pair of such crossings on a common round trip: the drive never has to
/// turn round on the spot.
void DropStreets(Grid& grid, Random& random) {
  std::vector<std::size_t> order(grid.edges.size());
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[random.Index(static_cast<int>(i))]);
  }
  const auto is_inner_block = [&grid](int block) {
    const int row = block / grid.side;
    const int column = block % grid.side;
    return row > 0 && column > 0 && row < grid.side - 2 && column < grid.side - 2;
  };
  std::vector<bool> joined(grid.nodes.size(), false);
  std::vector<bool> dropped(grid.edges.size(), false);
  for (const std::size_t i : order) {
    const auto [before, after] = grid.edges[i].blocks;
    if (!grid.edges[i].inner) {
      dropped[i] = random.Chance(0.2);
    } else if (is_inner_block(before) && is_inner_block(after) && !joined[before] &&
               !joined[after] && random.Chance(0.5)) {
      dropped[i] = joined[before] = joined[after] = true;
    }
  }
  std::vector<Edge> kept;
  for (std::size_t i = 0; i < grid.edges.size(); ++i) {
    if (!dropped[i]) kept.push_back(grid.edges[i]);
  }
  grid.edges = std::move(kept);
}

Grid MakeGrid(double length_m, Random& random) {
  const double route_streets = (length_m + kSpareRoute_m) / kMeanBlock_m + 2.0;
  int inner = 3;
  while (2.0 * inner * (inner - 1) < 1.7 * route_streets + 6.0) ++inner;

  Grid grid;
  grid.side = inner + 2;
  std::vector<double> xs(grid.side, 0.0);
  std::vector<double> ys(grid.side, 0.0);
  for (int i = 1; i < grid.side; ++i) {
    xs[i] = xs[i - 1] + random.Uniform(65.0, 145.0);
    ys[i] = ys[i - 1] + random.Uniform(65.0, 145.0);
  }
  const Eigen::Vector2d north = CosSin(random.Uniform(0.0, 6.28));
  for (int row = 0; row < grid.side; ++row) {
    for (int column = 0; column < grid.side; ++column) {
      const double x = xs[column] - xs.back() / 2 + random.Uniform(-11.0, 11.0);
      const double y = ys[row] - ys.back() / 2 + random.Uniform(-11.0, 11.0);
      grid.nodes.emplace_back(x * north.x() - y * north.y(), x * north.y() + y * north.x());
    }
  }
  for (int i = 0; i < 2 * grid.side; ++i) grid.lines.push_back(MakeLine(random));

  const auto is_inner = [&](int row, int column) {
    return row > 0 && column > 0 && row < grid.side - 1 && column < grid.side - 1;
  };
  for (int row = 0; row < grid.side; ++row) {
    for (int column = 0; column < grid.side; ++column) {
      const int node = row * grid.side + column;
      const bool inner_node = is_inner(row, column);
      if (column + 1 < grid.side) {
        grid.edges.push_back({node,
                              node + 1,
                              row,
                              inner_node && is_inner(row, column + 1),
                              {node - grid.side, node}});
      }
      if (row + 1 < grid.side) {
        grid.edges.push_back({node,
                              node + grid.side,
                              grid.side + column,
                              inner_node && is_inner(row + 1, column),
                              {node - 1, node}});
      }
    }
  }
  DropStreets(grid, random);
  grid.edges_of.resize(grid.nodes.size());
  for (std::size_t i = 0; i < grid.edges.size(); ++i) {
    grid.edges_of[grid.edges[i].from].push_back(static_cast<int>(i));
    grid.edges_of[grid.edges[i].to].push_back(static_cast<int>(i));
  }
  return grid;
}

Path MakeStreetPath(const Grid& grid, const Edge& edge, Random& random) {
  const Eigen::Vector2d begin = grid.nodes[edge.from];
  const Eigen::Vector2d end = grid.nodes[edge.to];
  const double bend =
      random.Chance(0.3) ? random.Uniform(-0.17, 0.17) : random.Uniform(-0.08, 0.08);
  const Eigen::Vector2d control =
      (begin + end) * 0.5 + (end - begin) * random.Uniform(-0.1, 0.1) + LeftOf(end - begin) * bend;
  std::vector<Eigen::Vector2d> curve;
  constexpr int kPieces = 64;
  for (int i = 0; i <= kPieces; ++i) {
    const double t = static_cast<double>(i) / kPieces;
    curve.emplace_back(begin * ((1 - t) * (1 - t)) + control * (2 * t * (1 - t)) + end * (t * t));
  }
  return Path(curve);
}

/// Chooses the streets of the drive, one after the other.
class Walk {
 public:
  Walk(const Grid& grid, Random& random)
      : grid_(grid), random_(random), used_(grid.edges.size(), false) {
    const int inner = grid.side - 2;
    const int row = 1 + random.Index(inner);
    node_ = row * grid.side + 1 + random.Index(inner);
  }

  [[nodiscard]] int node() const { return node_; }

  /// The next street from node(), which moves to its other end.
  int Step() {
    if (detour_.empty()) {
      const std::vector<int> open = Open(node_);
      if (open.empty()) {
        FindDetour();
      } else {
        detour_.push_back(Choose(open));
      }
    }
    const int edge = detour_.front();
    detour_.pop_front();
    used_[edge] = true;
    last_ = edge;
    node_ = OtherEnd(edge, node_);
    return edge;
  }

 private:
  [[nodiscard]] int OtherEnd(int edge, int node) const {
    return grid_.edges[edge].from == node ? grid_.edges[edge].to : grid_.edges[edge].from;
  }

  [[nodiscard]] std::vector<int> Open(int node) const {
    std::vector<int> open;
    for (const int edge : grid_.edges_of[node]) {
      if (grid_.edges[edge].inner && !used_[edge]) open.push_back(edge);
    }
    return open;
  }

  int Choose(const std::vector<int>& open) {
    std::vector<int> onward;  // streets that the drive can leave again
    for (const int edge : open) {
      if (Open(OtherEnd(edge, node_)).size() > 1) onward.push_back(edge);
    }
    const std::vector<int>& choices = onward.empty() ? open : onward;
    return choices[random_.Index(static_cast<int>(choices.size()))];
  }

  /// The shortest way to a crossing with an unused street, without turning round on the spot.
  void FindDetour() {
    std::vector<int> via(grid_.nodes.size(), -1);
    std::deque<int> queue = {node_};
    while (!queue.empty()) {
      const int node = queue.front();
      queue.pop_front();
      if (node != node_ && !Open(node).empty()) {
        for (int at = node; at != node_; at = OtherEnd(via[at], at)) detour_.push_front(via[at]);
        return;
      }
      for (const int edge : grid_.edges_of[node]) {
        const int next = OtherEnd(edge, node);
        if (edge == last_ || !grid_.edges[edge].inner || next == node_ || via[next] >= 0) continue;
        via[next] = edge;
        queue.push_back(next);
      }
    }
    // Every street was taken: start over.
    used_.assign(used_.size(), false);
    used_[last_] = true;
    detour_.push_back(Choose(Open(node_)));
  }

  const Grid& grid_;
  Random& random_;
  std::vector<bool> used_;
  std::deque<int> detour_;
  int node_ = 0;
  int last_ = -1;
};

/// A leg of the drive: one street in the direction driven.
Path MakeLeg(const Street& street, bool forward) {
  std::vector<Eigen::Vector2d> points = street.center.points();
  if (!forward) std::ranges::reverse(points);
  return Path(points);
}

/// How far before a crossing the turn from one leg into the next begins, so that the bend has
/// kRadius_m where the streets are long enough.
double TurnReach(const Path& leg, const Path& next) {
  constexpr double kRadius_m = 9.0;
  const double cos = leg.Tangent(leg.length_m()).dot(next.Tangent(0.0));
  const double tan_half = std::sqrt((1.0 - cos) / std::max(1.0 + cos, 1e-3));
  return std::min(
      {std::max(kRadius_m * tan_half, 3.0), 0.42 * leg.length_m(), 0.42 * next.length_m()});
}

/// Appends an arc between two points with given tangents, as a Bézier curve.
void AppendTurn(const Eigen::Vector2d& begin, const Eigen::Vector2d& begin_tangent,
                const Eigen::Vector2d& end, const Eigen::Vector2d& end_tangent,
                std::vector<Eigen::Vector2d>& to) {
  // For a circle the handles are chord / (3 cos²(φ/4)) long, φ being the angle turned.
  const double cos = std::max(-1.0, std::min(1.0, begin_tangent.dot(end_tangent)));
  const double cos_half = std::sqrt(0.5 * (1.0 + cos));
  const double handle = (end - begin).norm() / (1.5 * (1.0 + cos_half));
  const Eigen::Vector2d first = begin + begin_tangent * handle;
  const Eigen::Vector2d second = end - end_tangent * handle;
  constexpr int kPieces = 32;
  for (int i = 0; i <= kPieces; ++i) {
    const double t = static_cast<double>(i) / kPieces;
    const double u = 1.0 - t;
    to.emplace_back(begin * (u * u * u) + first * (3.0 * u * u * t) + second * (3.0 * u * t * t) +
                    end * (t * t * t));
  }
}

Path MakeRoute(const Grid& grid, const std::vector<Street>& streets, double length_m,
               Random& random) {
  constexpr double kCorner_m = 15.0;  // no turn cuts off more
  Walk walk(grid, random);
  std::vector<Path> legs;
  double length = 0.0;
  while (length < length_m + kSpareRoute_m) {
    const int begin = walk.node();
    const int edge = walk.Step();
    legs.push_back(MakeLeg(streets[edge], grid.edges[edge].from == begin));
    length += legs.back().length_m() - kCorner_m;
  }
  std::vector<Eigen::Vector2d> polyline;
  double cut_m = 0.0;  // off the beginning of the leg, by the turn into it
  for (std::size_t i = 0; i + 1 < legs.size(); ++i) {
    const Path& leg = legs[i];
    const Path& next = legs[i + 1];
    const double reach = TurnReach(leg, next);
    const double end_m = leg.length_m() - reach;
    for (double s = cut_m; s < end_m; s += Path::kStep_m) polyline.push_back(leg.At(s));
    AppendTurn(leg.At(end_m), leg.Tangent(end_m), next.At(reach), next.Tangent(reach), polyline);
    cut_m = reach;
  }
  const Path route(polyline);
  polyline.clear();
  for (double s = 0.0; s < length_m; s += Path::kStep_m) polyline.push_back(route.At(s));
  polyline.push_back(route.At(length_m));
  return Path(polyline);
}

}  // namespace

Network MakeNetwork(double length_m, Random random) {
  const Grid grid = MakeGrid(length_m, random);
  std::vector<double> crossing_half_m(grid.nodes.size(), 0.0);
  for (const Edge& edge : grid.edges) {
    for (const int node : {edge.from, edge.to}) {
      crossing_half_m[node] = std::max(crossing_half_m[node], grid.lines[edge.line].kerb_half_m);
    }
  }
  Network network;
  for (const Edge& edge : grid.edges) {
    const Line& line = grid.lines[edge.line];
    Street street;
    street.center = MakeStreetPath(grid, edge, random);
    street.lanes_half_m = line.lanes_half_m;
    street.kerb_half_m = line.kerb_half_m;
    street.num_lanes = line.num_lanes;
    street.begin_margin_m = crossing_half_m[edge.from] + 3.0;
    street.end_margin_m = crossing_half_m[edge.to] + 3.0;
    network.streets.push_back(std::move(street));
    network.classes.push_back(line.street_class);
  }
  network.route = MakeRoute(grid, network.streets, length_m, random);
  return network;
}

}  // namespace scanloc::sim
