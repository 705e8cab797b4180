#include "app/plant/page/wall.h"

#include <catch2/catch.hpp>

#include "app/base/http/html_text.h"
#include "app/plant/answers/state_words.h"

namespace plumbline::wall_test {

using namespace plumbline::plant;
using Catch::Contains;

namespace {

constexpr double kNow_utc = 1'800'000'000;

CellState Cell(int number, int health = 0, const std::string& reason = "") {
  CellState cell;
  cell.cell = number;
  cell.line = "line 1";
  cell.node = cell.name = "cell " + std::to_string(number);
  cell.born = cell.online = true;
  cell.received_utc = cell.state_utc = kNow_utc;
  cell.health = health;
  cell.health_reason = reason;
  return cell;
}

std::vector<std::int64_t> OrderOf(const Wall& wall) {
  std::vector<std::int64_t> order;
  for (const WallCard& card : wall.cards) order.push_back(card.cell);
  return order;
}

}  // namespace

TEST_CASE("who needs a person comes first; names are ordered as people count") {
  std::vector<CellState> cells = {Cell(10),
                                  Cell(9),
                                  Cell(3, 1, "a proposal"),
                                  Cell(4, 2, "drift"),
                                  Cell(5, 3, "robot data stale"),
                                  Cell(6),
                                  Cell(7)};
  cells[5].online = false;
  cells[6].online = false;
  cells[6].clean_shutdown = true;
  const Wall wall = WallFrom(cells, kNow_utc, {});
  CHECK(OrderOf(wall) == std::vector<std::int64_t>{5, 4, 6, 7, 3, 9, 10});
  CHECK(wall.strip.headline == "3 cells need a person");
  CHECK(wall.strip.style == "alarm");
  CHECK(wall.strip.reason == "7 cells · 1 ALARM · 1 ATTENTION · 2 NO DATA · 1 NOTE · 2 OK");
}

TEST_CASE("what is said once is not repeated, and hides nothing more urgent") {
  const auto texts = [](int health, const std::string& reason, double drift, int proposed) {
    CellState cell = Cell(1, health, reason);
    cell.drift_statistic = drift;
    cell.proposed_model = proposed;
    std::vector<std::string> said;
    for (const Finding& finding : FindingsOf(cell, kNow_utc)) said.push_back(finding.text);
    return said;
  };
  using Texts = std::vector<std::string>;
  CHECK(texts(0, "", 0.4, 0).empty());
  CHECK(texts(1, "", 0, 4) == Texts{"model 4 awaits approval"});
  CHECK(texts(2, "", 1.5, 0) == Texts{"drift: 1.5 times the limit"});
  CHECK(texts(3, "", 1.5, 4) ==
        Texts{"no reason given", "drift: 1.5 times the limit", "model 4 awaits approval"});
  CHECK(texts(2, "", 0, 4) == Texts{"no reason given", "model 4 awaits approval"});
}

TEST_CASE("a version changes only if something visible does, and only changed cards are sent") {
  std::vector<CellState> cells = {Cell(1), Cell(2), Cell(3)};
  const Wall first = WallFrom(cells, kNow_utc, {});
  CHECK(first.version == 1);
  for (CellState& cell : cells) cell.received_utc = kNow_utc + 1;
  const Wall second = WallFrom(cells, kNow_utc + 1, first);
  CHECK(second.version == 1);
  cells[1] = Cell(2, 2, "drift");
  const Wall third = WallFrom(cells, kNow_utc + 2, second);
  CHECK(third.version == 2);
  CHECK(third.cards[0].cell == 2);
  const std::string update = WallUpdateJson(third, 1, "s", "");
  CHECK_THAT(update, Contains("\"version\":\"s-2\"") && Contains("\"order\":[2,1,3]") &&
                         Contains("id=\\\"c2\\\"") && !Contains("id=\\\"c1\\\""));
  cells.pop_back();
  const Wall fourth = WallFrom(cells, kNow_utc + 3, third);
  CHECK(fourth.version == 3);
  CHECK(VersionFromText("s-2", "s") == 2);
  for (const char* const none : {"", "s", "t-2", "s-", "s-2x", "s--2", "s-99999999999999999999"}) {
    CHECK(VersionFromText(none, "s") == 0);
  }
}

TEST_CASE("nothing that a cell sends becomes markup or an address that a browser runs") {
  CellState cell = Cell(1, 2, "<img src=x onerror=alert(1)>");
  cell.name = "<script>alert('x')</script>";
  cell.line = "\" onclick=\"alert(1)";
  cell.arm_model = "</li><b>";
  cell.stale_lens = "left: </p><i>";
  cell.refused_utc = kNow_utc;
  cell.refused_reason = "'\"><svg>";
  for (const char* const page :
       {"javascript:alert(1)", "JavaScript:alert(1)", "data:text/html,x", "//evil.example/",
        "http://a/\"onmouseover=\"x", "http://a/ b", "https://a/\\b", "http://", "\thttp://a/"}) {
    cell.page = page;
    const Wall wall = WallFrom({cell}, kNow_utc, {});
    for (const bool by_line : {false, true}) {
      const std::string html = WallHtml(wall, {"\"><u>", "", by_line}, "s", "<problem>");
      for (const char* const markup : {"<img", "<script>", "<b>", "<i>", "<svg", "<u>", "<problem>",
                                       "\" onclick", "<a href=\"j", "evil", "onmouseover"}) {
        INFO(page << " " << markup);
        CHECK_THAT(html, !Contains(markup));
      }
    }
  }
  CHECK(http::WebAddress("https://cell-7.plant:8080/?a=b&c") == "https://cell-7.plant:8080/?a=b&c");
  CHECK(http::EscapedHtml(std::string("a\0b\x1b", 4)) == "a\uFFFDb\uFFFD");
  cell.page = "HTTPS://cell-7.plant/?a=b&c";
  CHECK_THAT(WallFrom({cell}, kNow_utc, {}).cards[0].html,
             Contains("<a href=\"HTTPS://cell-7.plant/?a=b&amp;c\" rel=\"noopener noreferrer\">"));
}

TEST_CASE("a cell that takes another's name is shown by its node") {
  CellState liar = Cell(9);
  liar.name = "cell 1";
  CHECK_THAT(WallFrom({Cell(1), liar}, kNow_utc, {}).cards[1].html, Contains("> cell 9 (cell 1)<"));
  CHECK(ShownName("cell-7", "Cell 7") == "Cell 7");
  CHECK(ShownName("a7", "Press 3 (a8)") == "a7 (Press 3 (a8))");
}

TEST_CASE("the wall is searched, filtered and grouped without a script") {
  std::vector<CellState> cells = {Cell(1), Cell(2, 2, "drift"), Cell(3)};
  cells[2].line = "line 2";
  const Wall wall = WallFrom(cells, kNow_utc, {});
  const auto shown = [&](const WallSelection& selection) {
    std::vector<std::int64_t> cells_shown;
    for (const WallCard& card : wall.cards) {
      if (selection.Shows(card)) cells_shown.push_back(card.cell);
    }
    return cells_shown;
  };
  using Cells = std::vector<std::int64_t>;
  CHECK(shown({}) == Cells{2, 1, 3});
  CHECK(shown({"line 1", "", false}) == Cells{2, 1});
  CHECK(shown({"drift cell", "", false}) == Cells{2});
  CHECK(shown({"", "person", false}) == Cells{2});
  CHECK(shown({"", "healthy", false}) == Cells{1, 3});
  CHECK(shown({"nothing", "", false}).empty());
  const std::string html = WallHtml(wall, {"drift", "", true}, "s", "");
  CHECK_THAT(html, Contains("<h2>line 2</h2>") && Contains("data-list=\"line line 2\"") &&
                       Contains("<li hidden id=\"c1\"") && Contains("<li id=\"c2\""));
}

}  // namespace plumbline::wall_test
