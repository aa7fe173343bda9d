#include "svg.hpp"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/report/csv.hpp"

namespace scanloc::report {
namespace {

std::string Attribute(const char* name, std::string_view value) {
  return absl::StrCat(" ", name, "=\"", XmlEscaped(value), "\"");
}

std::string Attribute(const char* name, double value) {
  return Attribute(name, ShortNumber(value));
}

}  // namespace

std::string XmlEscaped(std::string_view text) {
  return absl::StrReplaceAll(Printable(text),
                             {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}});
}

std::string ShortNumber(double value) {
  std::string text = FixedText(value, 2);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

Svg::Svg(const Eigen::Vector2d& size_px) {
  const std::string width = ShortNumber(size_px.x());
  const std::string height = ShortNumber(size_px.y());
  absl::StrAppend(&body_, "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"", width,
                  "\" height=\"", height, "\" viewBox=\"0 0 ", width, " ", height,
                  "\" font-family=\"sans-serif\">\n");
  Rect({0.0, 0.0}, size_px, "#ffffff");
}

void Svg::Path(const std::string& path, const Look& look) {
  absl::StrAppend(&body_, "<path d=\"", path, "\"", Attribute("fill", look.fill));
  if (look.stroke != "none") {
    absl::StrAppend(
        &body_, Attribute("stroke", look.stroke), Attribute("stroke-width", look.width_px),
        " stroke-linejoin=\"round\" stroke-linecap=\"", look.dashes.empty() ? "round\"" : "butt\"");
  }
  if (!look.dashes.empty()) body_ += Attribute("stroke-dasharray", look.dashes);
  if (look.tip.empty()) {
    body_ += "/>\n";
  } else {
    absl::StrAppend(&body_, "><title>", XmlEscaped(look.tip), "</title></path>\n");
  }
}

void Svg::Rect(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view fill) {
  absl::StrAppend(&body_, "<rect", Attribute("x", corner.x()), Attribute("y", corner.y()),
                  Attribute("width", size.x()), Attribute("height", size.y()),
                  Attribute("fill", fill), "/>\n");
}

void Svg::Text(const Eigen::Vector2d& at, std::string_view text, const Type& type) {
  const std::string x = ShortNumber(at.x());
  const std::string y = ShortNumber(at.y());
  absl::StrAppend(&body_, "<text");
  if (type.goes_up) {
    absl::StrAppend(&body_, " transform=\"translate(", x, " ", y, ") rotate(-90)\"");
  } else {
    absl::StrAppend(&body_, " x=\"", x, "\" y=\"", y, "\"");
  }
  absl::StrAppend(&body_, Attribute("font-size", type.size_px),
                  Attribute("text-anchor", type.anchor), Attribute("fill", type.fill),
                  type.is_bold ? " font-weight=\"bold\"" : "", ">", XmlEscaped(text), "</text>\n");
}

std::string Svg::Finish() { return std::exchange(body_, "") + "</svg>\n"; }

void AppendMove(const Eigen::Vector2d& to, std::string* path) {
  absl::StrAppend(path, "M", ShortNumber(to.x()), " ", ShortNumber(to.y()));
}

void AppendLine(const Eigen::Vector2d& to, std::string* path) {
  absl::StrAppend(path, "L", ShortNumber(to.x()), " ", ShortNumber(to.y()));
}

}  // namespace scanloc::report
