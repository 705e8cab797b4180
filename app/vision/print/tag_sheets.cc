#include "app/vision/print/tag_sheets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/vision/print/numbers.h"
#include "app/vision/print/sheet_frame.h"
#include "app/vision/print/tag_cells.h"

namespace plumbline::vision {
namespace {

// Layout of a tile: a tag with its border, an arrow above it and a dimension line below [mm].
constexpr double kArrowHeight = 5;
constexpr double kLabelHeight = 7;
constexpr double kMinTileWidth = 28;
constexpr double kTileGap = 6;
constexpr double kCutMark = 2.5;
constexpr double kCutMarkGrey = 0.5;
constexpr double kRounding_mm = 1e-6;

/// Width of the tag with its white border relative to the black square.
double WithBorder(const target::TagFamily& family) {
  return 1 + 2.0 / family.cells();
}

Vec2 TileSize(const target::TagFamily& family, double side_mm) {
  const double tag = WithBorder(family) * side_mm;
  return {std::max(tag, kMinTileWidth), kArrowHeight + tag + kLabelHeight};
}

/// A grid of tiles.
struct TileGrid {
  int columns = 0, rows = 0;
  int count() const { return columns * rows; }
};

TileGrid GridThatFits(const Vec2& tile, const Vec2& area) {
  const auto most = [](double room, double size) {
    return static_cast<int>(std::floor((room + kTileGap + kRounding_mm) / (size + kTileGap)));
  };
  return {most(area.x(), tile.x()), most(area.y(), tile.y())};
}

/// Side of the largest tag on a paper, rounded down to 0.1 mm.
double LargestSide(const target::TagFamily& family, const Paper& paper) {
  double largest = 0;
  for (const bool landscape : {false, true}) {
    const Vec2 area = FreeArea(paper.Size(landscape)).size;
    largest = std::max(
        largest, std::min(area.x(), area.y() - kArrowHeight - kLabelHeight) / WithBorder(family));
  }
  return std::floor(10 * largest) / 10;
}

Error TagTooLarge(const target::TagFamily& family, double side_mm, const Paper& paper) {
  std::string message = fmt::format(
      "a tag of {:g} mm takes {:.1f} mm with its white border and does not fit on {}, which takes "
      "tags of up to {:.1f} mm",
      side_mm, WithBorder(family) * side_mm, paper.name, LargestSide(family, paper));
  for (const Paper& other : Papers()) {
    if (LargestSide(family, other) < side_mm) continue;
    return {message + fmt::format("; choose a smaller tag, or --page {}", other.name)};
  }
  return {message + "; choose a smaller tag"};
}

/// Marks outside the corners of a tile, along which it is cut out.
void AddCutMarks(Sheet& sheet, const Rectangle& tile) {
  for (const double right : {0.0, 1.0}) {
    for (const double down : {0.0, 1.0}) {
      const Vec2 corner = tile.corner + Vec2(right, down).cwiseProduct(tile.size);
      const Vec2 x((2 * right - 1) * kCutMark, 0), y(0, (2 * down - 1) * kCutMark);
      sheet.lines.push_back({corner, corner + x, 0.1, kCutMarkGrey});
      sheet.lines.push_back({corner, corner + y, 0.1, kCutMarkGrey});
    }
  }
}

void AddTile(Sheet& sheet, const target::TagFamily& family, int id, double side_mm,
             const Rectangle& tile) {
  const double border = side_mm / family.cells();
  const double left = tile.centre().x() - 0.5 * side_mm;
  const double top = tile.corner.y() + kArrowHeight + border;
  AddUpArrow(sheet, {tile.centre().x(), tile.corner.y() + kArrowHeight - 0.5});
  AddTagCells(sheet, family, id, {tile.centre().x(), top + 0.5 * side_mm}, side_mm);
  AddDimension(sheet, {left, top + side_mm + border}, side_mm,
               fmt::format("{}, id {}: {:.6g} mm", family.name, id, side_mm), tile.size.x() - 2);
  AddCutMarks(sheet, tile);
}

/// "3 to 8, 10, 11" for ids in this order.
std::string IdList(const std::vector<int>& ids) {
  std::string list;
  for (std::size_t first = 0, last = 0; first < ids.size(); first = last + 1) {
    last = first;
    while (last + 1 < ids.size() && ids[last + 1] == ids[last] + 1) ++last;
    if (last == first + 1) last = first;  // two are not a range
    if (!list.empty()) list += ", ";
    list += fmt::format("{}", ids[first]);
    if (last > first) list += fmt::format(" to {}", ids[last]);
  }
  return list;
}

std::string TitleOf(const target::TagFamily& family, const std::vector<int>& ids) {
  return ids.size() == 1 ? fmt::format("Tag {}, id {}", family.name, ids[0])
                         : fmt::format("Tags {}, ids {}", family.name, IdList(ids));
}

FrameTexts TextsOf(const target::TagFamily& family, const std::vector<int>& ids, double side_mm) {
  FrameTexts texts{
      .title = TitleOf(family, ids),
      .notes = {"size_mm is the side of the black square, from outer edge to outer edge.",
                "Keep the white border: cut along the marks, glue onto something flat."},
      .file = "bodies.toml"};
  for (const int id : ids) {
    if (texts.blocks.size() + 1 == kMaxBlocks && ids.size() > kMaxBlocks) {
      texts.blocks.push_back({"# and the other", "# ids likewise"});
      break;
    }
    texts.blocks.push_back(TagLines(id, side_mm));
  }
  if (const auto drawn_by = DrawnByLine(family); drawn_by && texts.blocks.size() == 1) {
    texts.blocks[0].push_back(*drawn_by);
  }
  return texts;
}

}  // namespace

std::optional<std::string> DrawnByLine(const target::TagFamily& family) {
  if (!target::OpenCvTurns(family)) return std::nullopt;
  return "drawn_by = \"apriltag\"";
}

std::vector<std::string> TagLines(int id, double side_mm) {
  return {"[[tag]]", fmt::format("id = {}", id), "size_mm = " + TomlMm(side_mm)};
}

Result<Document> TagSheets(const target::TagFamily& family, const std::vector<int>& ids,
                           double side_mm, const Paper& paper) {
  const Vec2 tile = TileSize(family, side_mm);
  TileGrid grid = GridThatFits(tile, FreeArea(paper.Size(false)).size);
  const TileGrid turned = GridThatFits(tile, FreeArea(paper.Size(true)).size);
  const int count = static_cast<int>(ids.size());
  const bool landscape = std::min(turned.count(), count) > std::min(grid.count(), count);
  if (landscape) grid = turned;
  if (grid.count() == 0) return TagTooLarge(family, side_mm, paper);

  Document document{.title = TitleOf(family, ids), .size = paper.Size(landscape), .sheets = {}};
  const Rectangle area = FreeArea(document.size);
  grid.columns = std::min(grid.columns, count);
  grid.rows = std::min(grid.rows, (count + grid.columns - 1) / grid.columns);
  const Vec2 step = tile + Vec2::Constant(kTileGap);
  const Vec2 taken = step.cwiseProduct(Vec2(grid.columns, grid.rows)) - Vec2::Constant(kTileGap);
  const Vec2 first = area.centre() - 0.5 * taken;
  const int sheets = (count + grid.count() - 1) / grid.count();
  for (int number = 0; number < sheets; ++number) {
    const auto from = ids.begin() + number * grid.count();
    const auto until = number + 1 == sheets ? ids.end() : from + grid.count();
    Sheet& sheet = document.sheets.emplace_back();
    for (auto id = from; id != until; ++id) {
      const int k = static_cast<int>(id - from);
      const Vec2 place(k % grid.columns, k / grid.columns);
      AddTile(sheet, family, *id, side_mm, {first + step.cwiseProduct(place), tile});
    }
    FrameTexts texts = TextsOf(family, {from, until}, side_mm);
    if (sheets > 1) texts.sheet_number = fmt::format("sheet {} of {}", number + 1, sheets);
    AddFrame(sheet, document.size, texts);
  }
  return document;
}

}  // namespace plumbline::vision
