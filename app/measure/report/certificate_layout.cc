#include "app/measure/report/certificate_layout.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace plumbline::measure {
namespace {

// A4 less the print margins of the style sheet, and a margin for the estimate.
constexpr double kPage_mm = 278, kReserve_mm = 7, kTextWidth_mm = 180;
constexpr double kDecidingShare = 0.6;
constexpr int kHighestPoints = 250, kHighestDeciding = 400;
constexpr double kRow_mm = 4.4, kPower_mm = 0.9;  // a superscript makes a row higher
constexpr std::size_t kCellLength = 32;

/// Print style of a kind of paragraph.
struct Kind {
  std::string_view tag;     ///< start of its opening tag
  std::size_t line_length;  ///< characters
  double line_mm, around_mm;
};
constexpr Kind kKinds[] = {{"<p class=\"word\"", 60, 5.5, 3.0},
                           {"<p class=\"sentence\"", 88, 3.9, 0.4},
                           {"<p class=\"soft untested\"", 62, 3.3, 0.8},
                           {"<p class=\"soft\"", 112, 3.3, 0.8},
                           {"<p class=\"caption\"", 112, 3.3, 0.8},
                           {"<p class=\"digest\"", 135, 3.2, 2.0},
                           {"<p", 95, 3.9, 0.8}};

/// Number of characters outside tags; an entity is one.
std::size_t VisibleLength(std::string_view html) {
  std::size_t length = 0;
  bool tag = false, entity = false;
  for (const char c : html) {
    if (c == '<') tag = true;
    const bool continues = (static_cast<unsigned char>(c) & 0xC0) == 0x80;
    if (!tag && !entity && !continues) ++length;
    if (c == '&' && !tag) entity = true;
    if (c == ';') entity = false;
    if (c == '>') tag = false;
  }
  return length;
}

double Lines(std::size_t length, std::size_t of_line) {
  return std::max(1.0, std::ceil(static_cast<double>(length) / static_cast<double>(of_line)));
}

double Paragraph_mm(std::string_view html) {
  for (const Kind& kind : kKinds) {
    if (!html.starts_with(kind.tag)) continue;
    double lines = 0;
    for (std::size_t at = 0; at != std::string_view::npos;) {
      const std::size_t end = html.find("<br>", at);
      lines += Lines(VisibleLength(html.substr(at, end - at)), kind.line_length);
      at = end == std::string_view::npos ? end : end + 4;
    }
    return kind.around_mm + lines * kind.line_mm;
  }
  return 0;
}

double Row_mm(std::string_view html) {
  double lines = 1;
  for (auto at = html.find("<td"); at != std::string_view::npos; at = html.find("<td", at + 1)) {
    const std::string_view cell = html.substr(at, html.find("</td>", at) - at);
    lines = std::max(lines, Lines(VisibleLength(cell), kCellLength));
  }
  return lines * kRow_mm + (html.find("<sup>") == std::string_view::npos ? 0 : kPower_mm);
}

}  // namespace

double PrintedHeight_mm(const std::string& html) {
  const std::string_view text = html;
  double height_mm = 0;
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("<p>") || rest.starts_with("<p ")) {
      height_mm += Paragraph_mm(rest.substr(0, rest.find("</p>")));
    } else if (rest.starts_with("<tr")) {
      height_mm += Row_mm(rest.substr(0, rest.find("</tr>")));
    }
  }
  return height_mm;
}

FigureHeights HeightsBeside(double texts_mm, bool has_points) {
  const double free_px =
      (kPage_mm - kReserve_mm - texts_mm) * kCertificateFigureWidth / kTextWidth_mm;
  const FigureHeights least;
  FigureHeights heights;
  const double deciding = has_points ? kDecidingShare * free_px : free_px;
  heights.deciding = std::clamp(static_cast<int>(deciding), least.deciding, kHighestDeciding);
  heights.points =
      std::clamp(static_cast<int>(free_px) - heights.deciding, least.points, kHighestPoints);
  return heights;
}

}  // namespace plumbline::measure
