#include "app/vision/print/sheet_frame.h"

#include <fmt/format.h>

namespace plumbline::vision {
namespace {

// Layout [mm]. Office printers leave a margin of 4 to 5 mm blank.
constexpr double kMargin = 6;
constexpr double kTitleHeight = 8;
constexpr double kRulerStrip = 11;    // left of the free area: the upright ruler
constexpr double kFooterHeight = 26;  // below the free area: the other ruler and texts
constexpr double kGap = 3, kRulerGap = 1.5;
constexpr double kLineSpacing = 3.2;
constexpr double kBlockWidth = 26;
constexpr std::size_t kBlocksInColumn = 2;

/// Zero of the level ruler; the upright one has its zero beside it.
Vec2 RulerZero(const Vec2& paper) {
  return {kMargin + kRulerStrip, paper.y() - kMargin - kFooterHeight};
}

/// Adds a ruler in steps of 1 mm.
/// @param along   unit vector from 0 to 100
/// @param across  unit vector to the side of the ticks
void AddRuler(Sheet& sheet, const Vec2& zero, const Vec2& along, const Vec2& across) {
  sheet.lines.push_back({zero, zero + kRulerLength_mm * along, 0.15});
  for (int mm = 0; mm <= static_cast<int>(kRulerLength_mm); ++mm) {
    const bool end = mm == 0 || mm == static_cast<int>(kRulerLength_mm);
    const double tick = end ? 5 : mm % 10 == 0 ? 3.5 : mm % 5 == 0 ? 2.5 : 1.5;
    const Vec2 at = zero + mm * along;
    sheet.lines.push_back({at, at + tick * across, end ? 0.2 : 0.1});
    if (mm % 10 != 0) continue;
    // Numbers stand upright: below the ticks, or left of them.
    const bool below = across.y() > 0;
    const Vec2 number = at + (below ? Vec2(0, 7.2) : Vec2(-5.6, 0.75));
    sheet.texts.push_back({.at = number,
                           .words = fmt::format("{}", mm),
                           .size = 2.2,
                           .font = Font::kPlain,
                           .align = below ? Align::kCentre : Align::kRight});
  }
}

void AddBlocks(Sheet& sheet, const Vec2& corner, double width, const FrameTexts& texts) {
  sheet.texts.push_back({.at = corner,
                         .words = fmt::format("Lines for {}:", texts.file),
                         .max_width = width,
                         .font = Font::kBold});
  for (std::size_t k = 0; k < texts.blocks.size(); ++k) {
    const double x = kBlockWidth * static_cast<double>(k / kBlocksInColumn);
    double y = kLineSpacing * (1 + 3.4 * static_cast<double>(k % kBlocksInColumn));
    for (const std::string& line : texts.blocks[k]) {
      sheet.texts.push_back({.at = corner + Vec2(x, y),
                             .words = line,
                             .size = 2.5,
                             .max_width = texts.blocks.size() == 1 ? width : kBlockWidth - 1,
                             .font = Font::kFixedPitch});
      y += kLineSpacing;
    }
  }
}

}  // namespace

Rectangle FreeArea(const Vec2& paper) {
  const Vec2 corner(kMargin + kRulerStrip + kGap, kMargin + kTitleHeight);
  return {corner, Vec2(paper.x() - kMargin, RulerZero(paper).y() - kGap) - corner};
}

void AddFrame(Sheet& sheet, const Vec2& paper, const FrameTexts& texts) {
  const Rectangle area = FreeArea(paper);
  const double title_y = kMargin + 4;
  sheet.texts.push_back({.at = {RulerZero(paper).x(), title_y},
                         .words = texts.title,
                         .size = 3.8,
                         .max_width = area.size.x() - 25,
                         .font = Font::kBold});
  sheet.texts.push_back(
      {.at = {area.end().x(), title_y}, .words = texts.sheet_number, .align = Align::kRight});
  const Vec2 zero = RulerZero(paper);
  AddRuler(sheet, zero, Vec2::UnitX(), Vec2::UnitY());
  // Beside the other one, so that its zero tick does not lengthen the other's line.
  AddRuler(sheet, zero - kRulerGap * Vec2::UnitX(), -Vec2::UnitY(), -Vec2::UnitX());
  std::vector<std::string> lines = {
      "Print at 100 % (actual size), not fitted to the page. Then measure both rulers:",
      "if one is not 100.0 mm long, correct the scale of the printer and print again."};
  lines.insert(lines.end(), texts.notes.begin(), texts.notes.end());
  double y = 12;
  for (const std::string& line : lines) {
    sheet.texts.push_back(
        {.at = zero + Vec2(0, y), .words = line, .max_width = kRulerLength_mm + 2});
    y += 3.8;
  }
  const Vec2 blocks = zero + Vec2(kRulerLength_mm + 10, 1.5);
  AddBlocks(sheet, blocks, area.end().x() - blocks.x(), texts);
}

void AddUpArrow(Sheet& sheet, const Vec2& at) {
  sheet.outlines.push_back({at + Vec2(-0.4, 0), at + Vec2(-0.4, -2), at + Vec2(-1.3, -2),
                            at + Vec2(0, -4), at + Vec2(1.3, -2), at + Vec2(0.4, -2),
                            at + Vec2(0.4, 0)});
  sheet.texts.push_back({.at = at + Vec2(2.2, -0.3), .words = "up"});
}

void AddDimension(Sheet& sheet, const Vec2& from, double length, const std::string& words,
                  double room) {
  const Vec2 at = from + Vec2(0, 1);
  sheet.lines.push_back({at, at + Vec2(length, 0), 0.15});
  for (const double x : {0.0, length}) {
    sheet.lines.push_back({at + Vec2(x, -1), at + Vec2(x, 1), 0.15});
  }
  sheet.texts.push_back({.at = at + Vec2(0.5 * length, 3.8),
                         .words = words,
                         .max_width = room,
                         .align = Align::kCentre});
}

}  // namespace plumbline::vision
