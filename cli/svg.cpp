#include "cli/svg.hpp"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "cli/csv.hpp"

namespace scanloc::cli {
namespace {

std::string Number(double value) {
  std::string text = FixedText(value, 2);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

// Control characters have no place in XML, escaped or not, and bytes that are not ASCII may not be
// UTF-8.
std::string Escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '&') {
      escaped += "&amp;";
    } else if (c == '<') {
      escaped += "&lt;";
    } else if (c == '>') {
      escaped += "&gt;";
    } else if (c == '"') {
      escaped += "&quot;";
    } else if (c < ' ' || c == '\x7F') {
      escaped += '?';
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string Attribute(const char* name, double value) {
  return absl::StrCat(" ", name, "=\"", Number(value), "\"");
}

std::string Attribute(const char* name, std::string_view value) {
  return absl::StrCat(" ", name, "=\"", Escaped(value), "\"");
}

std::string Closed(const char* element, std::string_view tip) {
  if (tip.empty()) return "/>\n";
  return absl::StrCat("><title>", Escaped(tip), "</title></", element, ">\n");
}

const char* AnchorName(Svg::Anchor anchor) {
  switch (anchor) {
    case Svg::Anchor::kStart:
      return "start";
    case Svg::Anchor::kMiddle:
      return "middle";
    case Svg::Anchor::kEnd:
      return "end";
  }
  return "start";
}

}  // namespace

Svg::Svg(double width_px, double height_px)
    : body_(absl::StrFormat("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%s\" height=\"%s\" "
                            "viewBox=\"0 0 %s %s\" font-family=\"sans-serif\" fill=\"#222\">\n",
                            Number(width_px), Number(height_px), Number(width_px),
                            Number(height_px))) {}

void Svg::Rect(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view fill,
               std::string_view stroke) {
  absl::StrAppend(&body_, "<rect", Attribute("x", corner.x()), Attribute("y", corner.y()),
                  Attribute("width", size.x()), Attribute("height", size.y()),
                  Attribute("fill", fill), Attribute("stroke", stroke), "/>\n");
}

void Svg::Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, std::string_view stroke,
               double width_px) {
  absl::StrAppend(&body_, "<line", Attribute("x1", a.x()), Attribute("y1", a.y()),
                  Attribute("x2", b.x()), Attribute("y2", b.y()), Attribute("stroke", stroke),
                  Attribute("stroke-width", width_px), "/>\n");
}

void Svg::Polyline(const std::vector<Eigen::Vector2d>& points, std::string_view stroke,
                   double width_px) {
  std::string list;
  for (const Eigen::Vector2d& p : points) {
    absl::StrAppend(&list, list.empty() ? "" : " ", Number(p.x()), ",", Number(p.y()));
  }
  absl::StrAppend(&body_, "<polyline", Attribute("points", list), Attribute("fill", "none"),
                  Attribute("stroke", stroke), Attribute("stroke-width", width_px),
                  " stroke-linejoin=\"round\" stroke-linecap=\"round\"/>\n");
}

void Svg::Circle(const Eigen::Vector2d& center, double radius_px, std::string_view fill,
                 std::string_view tip) {
  absl::StrAppend(&body_, "<circle", Attribute("cx", center.x()), Attribute("cy", center.y()),
                  Attribute("r", radius_px), Attribute("fill", fill),
                  " stroke=\"white\" stroke-width=\"0.8\"", Closed("circle", tip));
}

void Svg::Cross(const Eigen::Vector2d& center, double radius_px, std::string_view stroke,
                std::string_view tip) {
  const std::string x0 = Number(center.x() - radius_px);
  const std::string x1 = Number(center.x() + radius_px);
  const std::string y0 = Number(center.y() - radius_px);
  const std::string y1 = Number(center.y() + radius_px);
  absl::StrAppend(&body_, "<path d=\"M", x0, " ", y0, " L", x1, " ", y1, " M", x0, " ", y1, " L",
                  x1, " ", y0, "\"", Attribute("stroke", stroke),
                  " stroke-width=\"2\" fill=\"none\"", Closed("path", tip));
}

void Svg::Text(const Eigen::Vector2d& at, std::string_view text, double size_px, Anchor anchor,
               bool bold) {
  absl::StrAppend(&body_, "<text", Attribute("x", at.x()), Attribute("y", at.y()),
                  Attribute("font-size", size_px), Attribute("text-anchor", AnchorName(anchor)),
                  bold ? " font-weight=\"bold\"" : "", ">", Escaped(text), "</text>\n");
}

void Svg::UpwardText(const Eigen::Vector2d& at, std::string_view text, double size_px) {
  const std::string x = Number(at.x());
  const std::string y = Number(at.y());
  absl::StrAppend(&body_, "<text transform=\"translate(", x, " ", y, ") rotate(-90)\"",
                  Attribute("font-size", size_px), " text-anchor=\"middle\">", Escaped(text),
                  "</text>\n");
}

std::string Svg::Finish() { return std::exchange(body_, "") + "</svg>\n"; }

}  // namespace scanloc::cli
