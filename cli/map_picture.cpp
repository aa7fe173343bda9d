#include "cli/map_picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "cli/query_result.hpp"
#include "cli/svg.hpp"

namespace scanloc::cli {
namespace {

using Eigen::Vector2d;

constexpr const char* kMapColor = "#a9b8c6";
constexpr const char* kRightColor = "#1a9641";
constexpr const char* kWrongColor = "#d7191c";
constexpr const char* kUncheckedColor = "#2166ac";
constexpr const char* kUnknownColor = "#7f7f7f";
constexpr const char* kGridColor = "#e8e8e8";
constexpr const char* kFrameColor = "#888";

constexpr double kPictureWidth_px = 1100.0;
constexpr double kLeft_px = 80.0;
constexpr double kRight_px = 25.0;
constexpr double kTop_px = 70.0;
constexpr double kBottom_px = 55.0;
constexpr double kTextSize_px = 14.0;
constexpr double kDotRadius_px = 4.5;

/// Lays the map frame on the page: equal scales, y up.
class Page {
 public:
  explicit Page(Eigen::AlignedBox2d extent_m) {
    constexpr double kSmallestSide_m = 20.0;
    const Vector2d missing_m =
        (Vector2d::Constant(kSmallestSide_m) - extent_m.sizes()).cwiseMax(0.0) / 2.0;
    const Vector2d border_m =
        missing_m + Vector2d::Constant(0.04 * std::max(extent_m.sizes().maxCoeff(), 1.0));
    extent_m.extend((extent_m.min() - border_m).eval());
    extent_m.extend((extent_m.max() + border_m).eval());

    constexpr double kLargestHeight_px = 900.0;
    constexpr double kSmallestHeight_px = 300.0;
    width_px_ = kPictureWidth_px - kLeft_px - kRight_px;
    height_px_ = std::clamp(width_px_ * extent_m.sizes().y() / extent_m.sizes().x(),
                            kSmallestHeight_px, kLargestHeight_px);
    px_per_m_ = std::min(width_px_ / extent_m.sizes().x(), height_px_ / extent_m.sizes().y());
    center_m_ = extent_m.center();
  }

  [[nodiscard]] double width_px() const { return width_px_; }
  [[nodiscard]] double height_px() const { return height_px_; }
  [[nodiscard]] double px_per_m() const { return px_per_m_; }
  [[nodiscard]] Vector2d Px(const Vector2d& m) const {
    return {kLeft_px + width_px_ / 2.0 + (m.x() - center_m_.x()) * px_per_m_,
            kTop_px + height_px_ / 2.0 - (m.y() - center_m_.y()) * px_per_m_};
  }
  /// What is shown, which is more than was asked for along one axis.
  [[nodiscard]] Eigen::AlignedBox2d Shown_m() const {
    const Vector2d half_m = Vector2d(width_px_, height_px_) / (2.0 * px_per_m_);
    return {Vector2d(center_m_ - half_m), Vector2d(center_m_ + half_m)};
  }

 private:
  double width_px_ = 0.0;
  double height_px_ = 0.0;
  double px_per_m_ = 1.0;
  Vector2d center_m_ = Vector2d::Zero();
};

Eigen::AlignedBox2d Extent(const std::vector<PicturedPlace>& places,
                           const std::vector<PicturedQuery>& queries) {
  Eigen::AlignedBox2d extent_m;
  for (const PicturedPlace& place : places) extent_m.extend(place.position);
  for (const PicturedQuery& query : queries) {
    if (query.answered.has_value()) extent_m.extend(*query.answered);
    if (query.truth.has_value()) extent_m.extend(*query.truth);
  }
  if (extent_m.isEmpty()) extent_m.extend(Vector2d(0.0, 0.0));
  return extent_m;
}

// 1, 2 or 5 times a power of ten, the least that leaves room for the numbers.
double TickStep_m(double px_per_m) {
  constexpr double kRoom_px = 90.0;
  const double rough_m = kRoom_px / px_per_m;
  const double power = std::pow(10.0, std::floor(std::log10(rough_m)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= rough_m) return step * power;
  }
  return 10.0 * power;
}

void DrawAxes(const Page& page, Svg* svg) {
  const Eigen::AlignedBox2d shown_m = page.Shown_m();
  const double step_m = TickStep_m(page.px_per_m());
  const int decimals = step_m < 1.0 ? 1 : 0;
  const double bottom_px = kTop_px + page.height_px();
  const double right_px = kLeft_px + page.width_px();
  for (double x = std::ceil(shown_m.min().x() / step_m) * step_m; x <= shown_m.max().x();
       x += step_m) {
    const double x_px = page.Px({x, 0.0}).x();
    svg->Line({x_px, kTop_px}, {x_px, bottom_px}, kGridColor, 1.0);
    svg->Text({x_px, bottom_px + 18.0}, absl::StrFormat("%.*f", decimals, x + 0.0), kTextSize_px,
              Svg::Anchor::kMiddle);
  }
  for (double y = std::ceil(shown_m.min().y() / step_m) * step_m; y <= shown_m.max().y();
       y += step_m) {
    const double y_px = page.Px({0.0, y}).y();
    svg->Line({kLeft_px, y_px}, {right_px, y_px}, kGridColor, 1.0);
    svg->Text({kLeft_px - 8.0, y_px + 5.0}, absl::StrFormat("%.*f", decimals, y + 0.0),
              kTextSize_px, Svg::Anchor::kEnd);
  }
  svg->Rect({kLeft_px, kTop_px}, {page.width_px(), page.height_px()}, "none", kFrameColor);
  svg->Text({kLeft_px + page.width_px() / 2.0, bottom_px + 42.0}, "x in the map frame [m]",
            kTextSize_px, Svg::Anchor::kMiddle);
  svg->UpwardText({20.0, kTop_px + page.height_px() / 2.0}, "y in the map frame [m]", kTextSize_px);
}

// A line between places that follow each other.
void DrawMap(const Page& page, const std::vector<PicturedPlace>& places, Svg* svg) {
  constexpr double kPathWidth_px = 5.0;
  std::vector<std::size_t> starts = StretchStarts(places);
  starts.push_back(places.size());
  for (std::size_t k = 0; k + 1 < starts.size(); ++k) {
    std::vector<Vector2d> path_px;
    for (std::size_t i = starts[k]; i < starts[k + 1]; ++i) {
      path_px.push_back(page.Px(places[i].position));
    }
    // A path of one point has no length to be drawn.
    svg->Circle(path_px.front(), kPathWidth_px / 2.0, kMapColor);
    svg->Polyline(path_px, kMapColor, kPathWidth_px);
  }
}

void DrawQueries(const Page& page, const std::vector<PicturedQuery>& queries, Verdict verdict,
                 Svg* svg) {
  for (const PicturedQuery& query : queries) {
    if (query.verdict != verdict) continue;
    if (verdict == Verdict::kNotRecognized) {
      if (!query.truth.has_value()) continue;
      svg->Circle(page.Px(*query.truth), kDotRadius_px, kUnknownColor,
                  query.query + ": not recognised");
      continue;
    }
    if (!query.answered.has_value()) continue;
    const Vector2d answered_px = page.Px(*query.answered);
    if (verdict == Verdict::kWrong) {
      if (query.truth.has_value()) {
        svg->Line(answered_px, page.Px(*query.truth), kWrongColor, 1.0);
      }
      svg->Cross(answered_px, kDotRadius_px, kWrongColor, query.query + ": wrong");
    } else if (verdict == Verdict::kRight) {
      svg->Circle(answered_px, kDotRadius_px, kRightColor, query.query + ": right");
    } else {
      svg->Circle(answered_px, kDotRadius_px, kUncheckedColor, query.query + ": localized");
    }
  }
}

/// One row of signs with their meaning, from left to right.
class Legend {
 public:
  explicit Legend(Svg* svg) : svg_(svg) {}

  void AddPath(const char* color, const std::string& text) {
    svg_->Line({x_px_ - 6.0, kY_px}, {x_px_ + 10.0, kY_px}, color, 5.0);
    AddText(text);
  }
  void AddDot(const char* color, const std::string& text) {
    svg_->Circle({x_px_, kY_px}, kDotRadius_px, color);
    AddText(text);
  }
  void AddCross(const char* color, const std::string& text) {
    svg_->Line({x_px_, kY_px}, {x_px_ + 10.0, kY_px}, color, 1.0);
    svg_->Cross({x_px_, kY_px}, kDotRadius_px, color);
    AddText(text);
  }

 private:
  static constexpr double kY_px = 50.0;
  static constexpr double kSignWidth_px = 16.0;
  static constexpr double kCharWidth_px = 0.55 * kTextSize_px;
  static constexpr double kGap_px = 28.0;

  void AddText(const std::string& text) {
    svg_->Text({x_px_ + kSignWidth_px, kY_px + 5.0}, text, kTextSize_px);
    x_px_ += kSignWidth_px + kCharWidth_px * static_cast<double>(text.size()) + kGap_px;
  }

  Svg* svg_;
  double x_px_ = kLeft_px + 6.0;
};

void DrawLegend(const std::vector<PicturedPlace>& places, const std::vector<PicturedQuery>& queries,
                Svg* svg) {
  const auto count = [&](Verdict verdict, bool truth_only) {
    return std::count_if(queries.begin(), queries.end(), [&](const PicturedQuery& query) {
      return query.verdict == verdict && (!truth_only || query.truth.has_value());
    });
  };
  const auto num_unchecked = count(Verdict::kUnchecked, false);
  const auto num_right = count(Verdict::kRight, false);
  const auto num_wrong = count(Verdict::kWrong, false);
  const auto num_unknown = count(Verdict::kNotRecognized, false);
  const bool checked = num_unchecked == 0 || num_right > 0 || num_wrong > 0;
  Legend legend(svg);
  legend.AddPath(kMapColor, absl::StrFormat("map: %d places", places.size()));
  if (checked) {
    legend.AddDot(kRightColor, absl::StrFormat("right: %d", num_right));
    legend.AddCross(kWrongColor,
                    absl::StrFormat("wrong: %d (line to the true position)", num_wrong));
  }
  if (num_unchecked > 0) {
    legend.AddDot(kUncheckedColor, absl::StrFormat("localized, unchecked: %d", num_unchecked));
  }
  const bool all_drawn = count(Verdict::kNotRecognized, true) == num_unknown;
  legend.AddDot(kUnknownColor, absl::StrFormat("not recognised: %d%s", num_unknown,
                                               all_drawn ? " (at the true position)"
                                                         : " (drawn where the truth is known)"));
}

}  // namespace

std::vector<std::size_t> StretchStarts(const std::vector<PicturedPlace>& places) {
  std::vector<double> steps_m;
  for (std::size_t i = 1; i < places.size(); ++i) {
    steps_m.push_back((places[i].position - places[i - 1].position).norm());
  }
  const double jump_m = std::max(10.0, 5.0 * Median(steps_m).value_or(0.0));
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool goes_on =
        i > 0 && places[i].session == places[i - 1].session && steps_m[i - 1] <= jump_m;
    if (!goes_on) starts.push_back(i);
  }
  return starts;
}

std::string DrawMapPicture(const std::string& title, const std::vector<PicturedPlace>& places,
                           const std::vector<PicturedQuery>& queries) {
  const Page page(Extent(places, queries));
  const double height_px = kTop_px + page.height_px() + kBottom_px;
  Svg svg(kPictureWidth_px, height_px);
  svg.Rect({0.0, 0.0}, {kPictureWidth_px, height_px}, "white");
  svg.Text({kLeft_px, 26.0}, title, 18.0, Svg::Anchor::kStart, true);
  DrawAxes(page, &svg);
  DrawMap(page, places, &svg);
  for (const Verdict verdict :
       {Verdict::kNotRecognized, Verdict::kRight, Verdict::kUnchecked, Verdict::kWrong}) {
    DrawQueries(page, queries, verdict, &svg);
  }
  DrawLegend(places, queries, &svg);
  return svg.Finish();
}

}  // namespace scanloc::cli
