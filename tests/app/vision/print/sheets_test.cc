// Layout of printed sheets: what is on them, what fits, and what is refused.
#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>

#include "app/base/config/body_reader.h"
#include "app/vision/print/board_sheet.h"
#include "app/vision/print/sheet_frame.h"
#include "app/vision/print/tag_cells.h"
#include "app/vision/print/tag_sheets.h"

namespace plumbline::sheets_test {

using namespace plumbline::vision;

namespace {

/// Twice the signed area enclosed by an outline [mm^2].
double DoubleArea(const Outline& outline) {
  double sum = 0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Vec2 &a = outline[k], &b = outline[(k + 1) % outline.size()];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return sum;
}

double BlackArea(const std::vector<Outline>& outlines) {
  return 0.5 * std::accumulate(
                   outlines.begin(), outlines.end(), 0.0,
                   [](double sum, const Outline& outline) { return sum + DoubleArea(outline); });
}

bool Mentions(const Sheet& sheet, const std::string& words) {
  return std::any_of(sheet.texts.begin(), sheet.texts.end(),
                     [&](const Text& text) { return text.words.find(words) != std::string::npos; });
}

/// Whether all lines and areas lie on the paper, with the margin that office printers need.
bool LiesOnPaper(const Sheet& sheet, const Vec2& paper) {
  const auto inside = [&](const Vec2& p) {
    return (p.array() >= 4.2).all() && ((paper - p).array() >= 4.2).all();
  };
  const bool lines = std::all_of(sheet.lines.begin(), sheet.lines.end(), [&](const Line& line) {
    return line.grey > 0 || (inside(line.from) && inside(line.to));
  });
  const bool outlines =
      std::all_of(sheet.outlines.begin(), sheet.outlines.end(),
                  [&](const Outline& one) { return std::all_of(one.begin(), one.end(), inside); });
  return lines && outlines;
}

target::TagFamily AprilTags() {
  return target::TagFamilyOfName("36h11").value();
}

const Paper kA4 = *PaperOfName("A4");

}  // namespace

TEST_CASE("cell outlines enclose the black cells, with holes and without inner edges") {
  // A ring of eight cells: one outer and one inner square.
  const auto ring =
      CellOutlines({true, true, true, true, false, true, true, true, true}, 3, Vec2(10, 20), 2);
  REQUIRE(ring.size() == 2);
  CHECK(ring[0].size() == 4);
  CHECK(ring[1].size() == 4);
  CHECK(BlackArea(ring) == Approx(8 * 4));
  CHECK(std::abs(DoubleArea(ring[0])) == Approx(2 * 36));
  // Cells that touch at a corner.
  const auto diagonal = CellOutlines({true, false, false, true}, 2, Vec2::Zero(), 1);
  CHECK(BlackArea(diagonal) == Approx(2));
  CHECK(CellOutlines({false, false}, 2, Vec2::Zero(), 1).empty());
}

TEST_CASE("a tag covers its black cells exactly, at the size given") {
  const target::TagFamily family = AprilTags();
  const auto document = TagSheets(family, {7}, 80, kA4);
  REQUIRE(document);
  CHECK(document->size == Vec2(210, 297));
  CHECK(document->title == "Tag 36h11, id 7");
  REQUIRE(document->sheets.size() == 1);
  const Sheet& sheet = document->sheets[0];
  const int white = std::popcount(family.codes[7]);
  std::vector<Outline> tag = sheet.outlines;
  std::erase_if(tag, [](const Outline& outline) { return outline.size() == 7; });  // the arrow
  CHECK(BlackArea(tag) == Approx((64 - white) * 100));
  CHECK(Mentions(sheet, "36h11, id 7: 80 mm"));
  CHECK(Mentions(sheet, "up"));
  CHECK(Mentions(sheet, "size_mm = 80.0"));
  CHECK(Mentions(sheet, "drawn_by = \"apriltag\""));
  CHECK(LiesOnPaper(sheet, document->size));
}

TEST_CASE("every sheet has two rulers of 100 mm, whose lines do not touch") {
  target::Board board;
  for (const auto& document : {TagSheets(AprilTags(), {7}, 80, kA4), BoardSheet(board, kA4)}) {
    REQUIRE(document);
    std::vector<Line> rulers;
    for (const Line& line : document->sheets[0].lines) {
      if ((line.to - line.from).norm() == Approx(kRulerLength_mm)) rulers.push_back(line);
    }
    REQUIRE(rulers.size() == 2);
    CHECK(rulers[0].from.y() == rulers[1].from.y());
    CHECK(rulers[0].from.x() - rulers[1].from.x() >= 1);
    CHECK((rulers[0].to - rulers[0].from).dot(rulers[1].to - rulers[1].from) == 0);
    CHECK(Mentions(document->sheets[0], "100.0 mm"));
  }
}

TEST_CASE("tags fill as few sheets as possible, in the orientation that takes more of them") {
  std::vector<int> ids(7);
  std::iota(ids.begin(), ids.end(), 3);
  const auto several = TagSheets(AprilTags(), ids, 60, kA4);
  REQUIRE(several);
  REQUIRE(several->sheets.size() == 2);
  CHECK(several->title == "Tags 36h11, ids 3 to 9");
  CHECK(Mentions(several->sheets[0], "sheet 1 of 2"));
  CHECK(Mentions(several->sheets[1], "36h11, id 9: 60 mm"));
  for (const Sheet& sheet : several->sheets) CHECK(LiesOnPaper(sheet, several->size));

  const auto wide = TagSheets(AprilTags(), {0, 1}, 90, kA4);  // side by side only
  REQUIRE(wide);
  CHECK(wide->sheets.size() == 1);
  CHECK(wide->size == Vec2(297, 210));

  const auto tiny = TagSheets(AprilTags(), {0, 1, 5}, 8, kA4);
  REQUIRE(tiny);
  CHECK(tiny->title == "Tags 36h11, ids 0, 1, 5");

  ids.resize(20);
  std::iota(ids.begin(), ids.end(), 0);
  const auto many = TagSheets(AprilTags(), ids, 20, kA4);
  REQUIRE(many);
  CHECK(Mentions(many->sheets[0], "# ids likewise"));
  CHECK_FALSE(Mentions(many->sheets[0], "id = 6"));
}

TEST_CASE("a tag that does not fit is refused with the largest that does") {
  const target::TagFamily family = AprilTags();
  const auto refused = TagSheets(family, {7}, 200, kA4);
  REQUIRE_FALSE(refused);
  CHECK(refused.error() ==
        "a tag of 200 mm takes 250.0 mm with its white border and does not fit on A4, which takes "
        "tags of up to 147.2 mm; choose a smaller tag, or --page A3");
  const auto largest = TagSheets(family, {7}, 147.2, kA4);
  REQUIRE(largest);
  CHECK(LiesOnPaper(largest->sheets[0], largest->size));
  CHECK_FALSE(TagSheets(family, {7}, 147.3, kA4));
  const auto huge = TagSheets(family, {7}, 1000, *PaperOfName("A3"));
  CHECK_THAT(huge.error(), Catch::EndsWith("; choose a smaller tag"));
}

TEST_CASE("a board that does not fit is refused with the largest square that does") {
  const target::Board board{.columns = 9, .rows = 6, .square_m = 0.03};
  const auto refused = BoardSheet(board, kA4);
  REQUIRE_FALSE(refused);
  CHECK(refused.error() ==
        "this board takes 314 x 224 mm with its white border and does not fit on A4, which takes "
        "squares of up to 20.1 mm; choose that, fewer points, or --page A3");
  CHECK(BoardSheet({.columns = 9, .rows = 6, .square_m = 0.0201}, kA4));
  CHECK_FALSE(BoardSheet({.columns = 9, .rows = 6, .square_m = 0.0202}, kA4));
  const auto large = BoardSheet(board, *PaperOfName("A3"));
  REQUIRE(large);
  CHECK(large->size == Vec2(420, 297));
  CHECK(LiesOnPaper(large->sheets[0], large->size));
  const target::Board tall{.columns = 6, .rows = 9, .square_m = 0.02};
  CHECK(BoardSheet(tall, kA4)->size == Vec2(210, 297));
  const target::Board circles{.columns = 30,
                              .rows = 20,
                              .square_m = 0.02,
                              .kind = target::BoardKind::kCircles,
                              .marker_m = 0.01};
  CHECK_THAT(BoardSheet(circles, *PaperOfName("A3")).error(),
             Catch::Contains("a row spacing of up to") &&
                 Catch::EndsWith("; choose that, or fewer points"));
}

TEST_CASE("the lines for bodies.toml are read back as the tag that was printed") {
  std::string text = "schema = 1\n";
  for (const int id : {7, 12}) {
    for (const std::string& line : TagLines(id, 62.5)) text += line + "\n";
    text += DrawnByLine(AprilTags()).value() + "\n";
  }
  config::FaultList faults;
  const auto read = config::TagDatabaseFromText(text, "bodies.toml", faults);
  REQUIRE(read);
  REQUIRE(read->tags.size() == 2);
  CHECK(read->tags[1].id == 12);
  CHECK(read->tags[1].side_m == Approx(0.0625));
  CHECK(read->tags[1].drawn_by == target::DrawnBy::kAprilTag);
  CHECK_FALSE(DrawnByLine(target::TagFamilyOfName("aruco-4x4-50").value()));
}

}  // namespace plumbline::sheets_test
