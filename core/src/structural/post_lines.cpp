#include "structural/post_lines.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace scanloc {
namespace {

/// A line is fitted to what stands within so many cells of a post ...
constexpr double kFitReach = 3.0;
/// ... if that is so many posts, itself among them, and lies within so small a share of its length.
constexpr int kMinPosts = 4;
constexpr double kMaxWidthShare = 0.05;
/// A post is compared with another's line within so many cells.
constexpr double kReach = 2.0;
/// The grid is no finer than this share of the posts' extent.
constexpr float kMaxGridShare = 1.0F / 256.0F;
/// Of a cell of the grid, so many posts are kept: four times what fits there a cell apart. Whoever
/// made a map may have put all in one.
constexpr std::uint32_t kMaxCrowd = 64;

constexpr int kNumSteps = 10;
constexpr double kNarrowing = 0.75;  ///< of the weights, from step to step
constexpr std::size_t kMaxRefined = 256;

struct Turned {
  explicit Turned(const PlanarPose& pose)
      : cosine(static_cast<float>(std::cos(pose.yaw_rad))),
        sine(static_cast<float>(std::sin(pose.yaw_rad))),
        x_m(static_cast<float>(pose.x_m)),
        y_m(static_cast<float>(pose.y_m)) {}

  float cosine, sine, x_m, y_m;
};

}  // namespace

template <typename Visitor>
void PostLines::VisitNear(float x_m, float y_m, float reach_m, const Visitor& visit) const {
  if (lines_.empty()) return;
  // As numbers that fit any distance: a pose may lie far off.
  const auto cell = [this](float from_m) { return std::floor(from_m / grid_cell_m_); };
  const float left = cell(x_m - reach_m - least_x_m_);
  const float right = cell(x_m + reach_m - least_x_m_);
  const float low = cell(y_m - reach_m - least_y_m_);
  const float high = cell(y_m + reach_m - least_y_m_);
  if (!(right >= 0.0F && left < static_cast<float>(num_columns_)) ||
      !(high >= 0.0F && low < static_cast<float>(num_rows_))) {
    return;
  }
  const auto within = [](float value, int num_cells) {
    return static_cast<std::size_t>(std::clamp(value, 0.0F, static_cast<float>(num_cells - 1)));
  };
  const std::size_t last_row = within(high, num_rows_);
  for (std::size_t row = within(low, num_rows_); row <= last_row; ++row) {
    const std::size_t first_of_row = row * static_cast<std::size_t>(num_columns_);
    const std::uint32_t end = begins_[first_of_row + within(right, num_columns_) + 1];
    for (std::uint32_t i = begins_[first_of_row + within(left, num_columns_)]; i < end; ++i) {
      visit(lines_[i]);
    }
  }
}

PostLines::PostLines(std::span<const Post> posts, double cell_m)
    : cell_m_(cell_m), grid_cell_m_(static_cast<float>(kFitReach * cell_m)) {
  if (posts.empty()) return;
  const auto [left, right] = std::minmax_element(
      posts.begin(), posts.end(), [](const Post& a, const Post& b) { return a.x_cm < b.x_cm; });
  const auto [low, high] = std::minmax_element(
      posts.begin(), posts.end(), [](const Post& a, const Post& b) { return a.y_cm < b.y_cm; });
  least_x_m_ = 0.01F * static_cast<float>(left->x_cm);
  least_y_m_ = 0.01F * static_cast<float>(low->y_cm);
  const float width_m = 0.01F * static_cast<float>(right->x_cm - left->x_cm);
  const float height_m = 0.01F * static_cast<float>(high->y_cm - low->y_cm);
  grid_cell_m_ = std::max(grid_cell_m_, kMaxGridShare * std::max(width_m, height_m));
  num_columns_ = static_cast<int>(width_m / grid_cell_m_) + 1;
  num_rows_ = static_cast<int>(height_m / grid_cell_m_) + 1;

  const auto cell_of = [&](const Post& post) {
    const auto column =
        static_cast<int>((0.01F * static_cast<float>(post.x_cm) - least_x_m_) / grid_cell_m_);
    const auto row =
        static_cast<int>((0.01F * static_cast<float>(post.y_cm) - least_y_m_) / grid_cell_m_);
    return static_cast<std::size_t>(std::min(row, num_rows_ - 1) * num_columns_ +
                                    std::min(column, num_columns_ - 1));
  };
  begins_.assign(static_cast<std::size_t>(num_columns_ * num_rows_) + 1, 0);
  for (const Post& post : posts) {
    std::uint32_t& num = begins_[cell_of(post) + 1];
    num = std::min(num + 1, kMaxCrowd);
  }
  for (std::size_t i = 1; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
  std::vector<std::uint32_t> next(begins_.begin(), begins_.end() - 1);
  lines_.resize(begins_.back());
  for (const Post& post : posts) {
    const std::size_t cell = cell_of(post);
    if (next[cell] == begins_[cell + 1]) continue;
    Line& line = lines_[next[cell]++];
    line.x_m = 0.01F * static_cast<float>(post.x_cm);
    line.y_m = 0.01F * static_cast<float>(post.y_cm);
  }
  std::vector<Line> fitted(lines_.size());
  std::transform(lines_.begin(), lines_.end(), fitted.begin(),
                 [this](const Line& post) { return LineAt(post); });
  lines_ = std::move(fitted);
}

PostLines::Line PostLines::LineAt(const Line& post) const {
  const auto reach_m = static_cast<float>(kFitReach * cell_m_);
  int num = 0;
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  VisitNear(post.x_m, post.y_m, reach_m, [&](const Line& other) {
    const double dx = other.x_m - post.x_m;
    const double dy = other.y_m - post.y_m;
    if (dx * dx + dy * dy > reach_m * reach_m) return;
    ++num;
    x += dx;
    y += dy;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
  });
  if (num < kMinPosts) return post;
  x /= num;
  y /= num;
  xx = xx / num - x * x;
  xy = xy / num - x * y;
  yy = yy / num - y * y;
  const double along_rad = 0.5 * std::atan2(2.0 * xy, xx - yy);
  const double longest = 0.5 * (xx + yy) + std::hypot(0.5 * (xx - yy), xy);
  const double across_x = -std::sin(along_rad);
  const double across_y = std::cos(along_rad);
  const double off_m = across_x * x + across_y * y;
  Line line{static_cast<float>(post.x_m + off_m * across_x),
            static_cast<float>(post.y_m + off_m * across_y)};
  if (xx + yy - longest < kMaxWidthShare * longest) {
    line.across_x = static_cast<float>(across_x);
    line.across_y = static_cast<float>(across_y);
  }
  return line;
}

const PostLines::Line* PostLines::Nearest(float x_m, float y_m) const {
  const auto reach_m = static_cast<float>(kReach * cell_m_);
  const Line* nearest = nullptr;
  float least = reach_m * reach_m;
  VisitNear(x_m, y_m, reach_m, [&](const Line& line) {
    const float dx = line.x_m - x_m;
    const float dy = line.y_m - y_m;
    const float squared = dx * dx + dy * dy;
    if (squared < least) {
      least = squared;
      nearest = &line;
    }
  });
  return nearest;
}

PlanarPose PostLines::Refined(const PostLines& on, PlanarPose T_on_these, double inlier_m) const {
  const std::size_t step =
      std::max<std::size_t>(1, (lines_.size() + kMaxRefined - 1) / kMaxRefined);
  double width_m = cell_m_;
  for (int i = 0; i < kNumSteps; ++i) {
    const double squared_width = std::pow(width_m + 0.5 * inlier_m, 2);
    const Turned turned(T_on_these);
    Eigen::Matrix3d hessian = 1e-6 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < lines_.size(); k += step) {
      const float x_m = turned.cosine * lines_[k].x_m - turned.sine * lines_[k].y_m;
      const float y_m = turned.sine * lines_[k].x_m + turned.cosine * lines_[k].y_m;
      const Line* line = on.Nearest(x_m + turned.x_m, y_m + turned.y_m);
      if (line == nullptr || !line->is_line()) continue;
      const double error_m = line->across_x * (x_m + turned.x_m - line->x_m) +
                             line->across_y * (y_m + turned.y_m - line->y_m);
      const double less = 1.0 + error_m * error_m / squared_width;
      const double weight = 1.0 / (less * less);
      const Eigen::Vector3d slope(line->across_x, line->across_y,
                                  line->across_y * x_m - line->across_x * y_m);
      hessian += weight * slope * slope.transpose();
      gradient += weight * error_m * slope;
    }
    const Eigen::Vector3d step_back = hessian.ldlt().solve(gradient);
    T_on_these = {T_on_these.x_m - step_back.x(), T_on_these.y_m - step_back.y(),
                  T_on_these.yaw_rad - step_back.z()};
    width_m *= kNarrowing;
  }
  return T_on_these;
}

double PostLines::ShareOn(const PostLines& on, const PlanarPose& T_on_these,
                          double inlier_m) const {
  const Turned turned(T_on_these);
  std::size_t num_inliers = 0;
  for (const Line& post : lines_) {
    const float x_m = turned.cosine * post.x_m - turned.sine * post.y_m + turned.x_m;
    const float y_m = turned.sine * post.x_m + turned.cosine * post.y_m + turned.y_m;
    const Line* line = on.Nearest(x_m, y_m);
    if (line == nullptr) continue;
    const float dx = x_m - line->x_m;
    const float dy = y_m - line->y_m;
    const float off_m =
        line->is_line() ? std::abs(line->across_x * dx + line->across_y * dy) : std::hypot(dx, dy);
    num_inliers += off_m < inlier_m ? 1 : 0;
  }
  return static_cast<double>(num_inliers) /
         static_cast<double>(std::max<std::size_t>(1, lines_.size()));
}

double PostLines::InlierRatioOn(const PostLines& place, const PlanarPose& T_place_these,
                                double inlier_m) const {
  const PlanarPose T = Refined(place, T_place_these, inlier_m);
  return std::sqrt(ShareOn(place, T, inlier_m) * place.ShareOn(*this, Inverse(T), inlier_m));
}

}  // namespace scanloc
