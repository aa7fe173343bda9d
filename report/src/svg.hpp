#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

namespace scanloc::report {

/// Text as it may stand in XML or HTML, between tags or in quotes, wherever it comes from.
[[nodiscard]] std::string XmlEscaped(std::string_view text);

/// A number with two decimals at most.
[[nodiscard]] std::string ShortNumber(double value);

/// Writes an `<svg>` element, in pixels with y down, that needs nothing else and gives no id. Later
/// shapes lie on earlier ones. Colours are CSS colours.
class Svg {
 public:
  Svg(const Eigen::Vector2d& size_px);

  struct Look {
    std::string_view fill = "none";
    std::string_view stroke = "none";
    double width_px = 1.0;
    std::string_view dashes = "";  ///< lengths of strokes and gaps [px]; empty: none
    std::string_view tip = "";     ///< shows when the pointer rests on it
  };
  /// `path` in SVG's own language.
  void Path(const std::string& path, const Look& look);
  void Rect(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view fill);

  struct Type {
    double size_px = 12.0;
    std::string_view anchor = "start";  ///< start, middle or end of the text is at its point
    std::string_view fill = "#222";
    bool is_bold = false;
    bool goes_up = false;  ///< from bottom to top
  };
  void Text(const Eigen::Vector2d& at, std::string_view text, const Type& type);

  /// The element; the object is empty then.
  [[nodiscard]] std::string Finish();

 private:
  std::string body_;
};

/// The begin of a path, or another stretch of it: `M x y`, and the line to the next point.
void AppendMove(const Eigen::Vector2d& to, std::string* path);
void AppendLine(const Eigen::Vector2d& to, std::string* path);

}  // namespace scanloc::report
