#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace scanloc::cli {

/// Draws an SVG document, in pixels with y down. Later shapes lie on earlier ones.
class Svg {
 public:
  /// How text leans on its point.
  enum class Anchor { kStart, kMiddle, kEnd };

  Svg(double width_px, double height_px);

  /// `stroke` and `fill` are CSS colours.
  void Rect(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view fill,
            std::string_view stroke = "none");
  void Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, std::string_view stroke,
            double width_px);
  void Polyline(const std::vector<Eigen::Vector2d>& points, std::string_view stroke,
                double width_px);
  /// `tip`, if not empty, shows when the pointer rests on it.
  void Circle(const Eigen::Vector2d& center, double radius_px, std::string_view fill,
              std::string_view tip = "");
  void Cross(const Eigen::Vector2d& center, double radius_px, std::string_view stroke,
             std::string_view tip = "");
  void Text(const Eigen::Vector2d& at, std::string_view text, double size_px,
            Anchor anchor = Anchor::kStart, bool bold = false);
  /// Text from bottom to top, centred on its point.
  void UpwardText(const Eigen::Vector2d& at, std::string_view text, double size_px);

  /// The document; the object is empty then.
  [[nodiscard]] std::string Finish();

 private:
  std::string body_;
};

}  // namespace scanloc::cli
