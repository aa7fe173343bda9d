#include <algorithm>
#include <cmath>

#include "random.hpp"
#include "scanloc/sim/town.hpp"

namespace scanloc::sim {

Path::Path(const std::vector<Eigen::Vector2d>& polyline) {
  double along = 0.0;  // of the polyline's segment begin
  double next = 0.0;   // distance of the next point
  for (std::size_t i = 0; i + 1 < polyline.size(); ++i) {
    const double length = (polyline[i + 1] - polyline[i]).norm();
    for (; next < along + length; next += kStep_m) {
      points_.emplace_back(polyline[i] +
                           (polyline[i + 1] - polyline[i]) * ((next - along) / length));
    }
    along += length;
  }
  // The rest of a step is kept as a last, shorter one, so that the path ends where it was asked to.
  points_.push_back(polyline.back());
  length_m_ = along;
}

Eigen::Vector2d Path::At(double distance_m) const {
  const double clamped = std::clamp(distance_m, 0.0, length_m_);
  const std::size_t i = std::min(static_cast<std::size_t>(clamped / kStep_m), points_.size() - 2);
  const double begin = static_cast<double>(i) * kStep_m;
  const double end = std::min(begin + kStep_m, length_m_);
  if (end <= begin) return points_[i];
  return points_[i] + (points_[i + 1] - points_[i]) * ((clamped - begin) / (end - begin));
}

Eigen::Vector2d Path::Tangent(double distance_m) const {
  const double low = std::clamp(distance_m - kStep_m, 0.0, std::max(0.0, length_m_ - 2 * kStep_m));
  const Eigen::Vector2d step = At(low + 2 * kStep_m) - At(low);
  return step / std::sqrt(step.x() * step.x() + step.y() * step.y());
}

Ground::Ground(const Eigen::Vector2d& lower, const Eigen::Vector2d& upper) : lower_(lower) {
  const auto cells = [](double length, double cell) {
    return std::max(1, static_cast<int>(std::ceil(length / cell)));
  };
  const Eigen::Vector2d size = upper - lower;
  num_columns_ = cells(size.x(), kTerrainCell_m) + 1;
  num_rows_ = cells(size.y(), kTerrainCell_m) + 1;
  heights_m_.assign(static_cast<std::size_t>(num_columns_) * num_rows_, 0.0);
  num_kerb_columns_ = cells(size.x(), kKerbCell_m);
  num_kerb_rows_ = cells(size.y(), kKerbCell_m);
  lowered_.assign(static_cast<std::size_t>(num_kerb_columns_) * num_kerb_rows_, false);
}

void Ground::Shape(std::span<const Wave> waves) {
  const auto at = [this](int column, int row) -> double& {
    return heights_m_[static_cast<std::size_t>(row) * num_columns_ + column];
  };
  for (int row = 0; row < num_rows_; ++row) {
    for (int column = 0; column < num_columns_; ++column) {
      const Eigen::Vector2d here = lower_ + Eigen::Vector2d(column, row) * kTerrainCell_m;
      double height_m = 0.0;
      for (const Wave& wave : waves) {
        height_m += wave.height_m * CosSin(here.dot(wave.number) + wave.phase).y();
      }
      at(column, row) = height_m;
      // A bilinear cell is nowhere steeper than its edges' slopes along x and y together.
      const double dx = column > 0 ? std::abs(height_m - at(column - 1, row)) : 0.0;
      const double dy = row > 0 ? std::abs(height_m - at(column, row - 1)) : 0.0;
      max_slope_ = std::max(max_slope_, 1.5 * std::max(dx, dy) / kTerrainCell_m);
    }
  }
}

void Ground::CarveStreet(const Path& center, double half_width_m) {
  for (const Eigen::Vector2d& point : center.points()) {
    const Eigen::Vector2d local = point - lower_;
    const auto range = [&](double value, int count) {
      return std::pair(std::max(0, static_cast<int>((value - half_width_m) / kKerbCell_m)),
                       std::min(count - 1, static_cast<int>((value + half_width_m) / kKerbCell_m)));
    };
    const auto [first_column, last_column] = range(local.x(), num_kerb_columns_);
    const auto [first_row, last_row] = range(local.y(), num_kerb_rows_);
    for (int row = first_row; row <= last_row; ++row) {
      for (int column = first_column; column <= last_column; ++column) {
        const Eigen::Vector2d cell((column + 0.5) * kKerbCell_m, (row + 0.5) * kKerbCell_m);
        if ((cell - local).squaredNorm() > half_width_m * half_width_m) continue;
        lowered_[static_cast<std::size_t>(row) * num_kerb_columns_ + column] = true;
      }
    }
  }
}

double Ground::Height(double x, double y) const {
  if (heights_m_.empty()) return 0.0;
  const double u = std::clamp((x - lower_.x()) / kTerrainCell_m, 0.0, num_columns_ - 1.0);
  const double v = std::clamp((y - lower_.y()) / kTerrainCell_m, 0.0, num_rows_ - 1.0);
  const int column = std::min(static_cast<int>(u), num_columns_ - 2);
  const int row = std::min(static_cast<int>(v), num_rows_ - 2);
  const double fu = u - column;
  const double fv = v - row;
  const double* low = &heights_m_[static_cast<std::size_t>(row) * num_columns_ + column];
  const double* high = low + num_columns_;
  return (low[0] * (1.0 - fu) + low[1] * fu) * (1.0 - fv) +
         (high[0] * (1.0 - fu) + high[1] * fu) * fv;
}

bool Ground::IsRaised(double x, double y) const {
  if (lowered_.empty()) return false;
  const double column = (x - lower_.x()) / kKerbCell_m;
  const double row = (y - lower_.y()) / kKerbCell_m;
  if (!(column >= 0.0 && row >= 0.0 && column < num_kerb_columns_ && row < num_kerb_rows_)) {
    return true;
  }
  return !lowered_[static_cast<std::size_t>(row) * num_kerb_columns_ +
                   static_cast<std::size_t>(column)];
}

}  // namespace scanloc::sim
