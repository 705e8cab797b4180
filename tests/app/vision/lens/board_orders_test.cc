// Views of a board that was held another way round are renumbered where that matters, and only
// there.
#include "app/vision/lens/board_orders.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "app/vision/lens/calibration.h"
#include "app/vision/lens/view_selection.h"
#include "tests/app/vision/lens/stated_camera.h"
#include "tests/lens_captures/capture_maker.h"

namespace plumbline::board_orders_test {

using namespace plumbline::vision;
using namespace plumbline::lens_captures;

namespace {

Conditions ConditionsFor(const target::Board& board, Random& random) {
  Conditions conditions = GoodConditions(random);
  conditions.board = board;
  return conditions;
}

/// Height of an S over a board, 2 % of half its width.
void MakeSShaped(Conditions& conditions) {
  const double half = conditions.board.Centre().x();
  conditions.deform = [half](int, const Vector3d& p) {
    const double x = p.x() / half;
    return Vector3d(p.x(), p.y(), 0.02 * half * (x * x * x - x));
  };
}

std::vector<int> QuartersOf(const target::Board& board) {
  std::vector<int> quarters;
  for (const target::BoardTurn& turn : target::SymmetriesOf(board))
    quarters.push_back(turn.quarters);
  return quarters;
}

/// Turns view j by the board's turn of index of[j], or back.
std::vector<BoardView> TurnedViews(const target::Board& board, std::vector<BoardView> views,
                                   const std::vector<std::size_t>& of) {
  const auto turns = target::SymmetriesOf(board);
  for (std::size_t j = 0; j < views.size(); ++j) views[j] = Turned(views[j], turns[of[j]]);
  return views;
}

/// The turns of a board that lead from one set of views to the other; 99 if there is none.
std::set<std::size_t> TurnsBetween(const target::Board& board, const std::vector<BoardView>& from,
                                   const std::vector<BoardView>& to) {
  const auto turns = target::SymmetriesOf(board);
  std::set<std::size_t> found;
  for (std::size_t j = 0; j < from.size(); ++j) {
    std::size_t of_view = 99;
    for (std::size_t t = 0; t < turns.size(); ++t) {
      if (Turned(from[j], turns[t]).corners_px == to[j].corners_px) of_view = t;
    }
    found.insert(of_view);
  }
  return found;
}

std::vector<std::size_t> RandomTurns(const target::Board& board, std::size_t views,
                                     Random& random) {
  std::vector<std::size_t> turns;
  for (std::size_t j = 0; j < views; ++j)
    turns.push_back(random() % target::SymmetriesOf(board).size());
  return turns;
}

/// Renumbers the views of a capture.
bool Renumber(const Conditions& conditions, std::vector<BoardView>& views) {
  const image::ImageSize size{conditions.width, conditions.height};
  const auto fit = FitLens(conditions.board, views, size);
  REQUIRE(fit);
  const ViewConsistency consistency = ConsistencyOf(conditions.board, *fit, views);
  return RenumberToOneOrder(conditions.board, size, *fit, consistency, views);
}

}  // namespace

TEST_CASE("turns that leave a board's points and colours in place") {
  using Quarters = std::vector<int>;
  using enum target::BoardKind;
  CHECK(QuartersOf({17, 11, 0.01}) == Quarters{0, 2});
  CHECK(QuartersOf({10, 8, 0.01}) == Quarters{0, 2});
  CHECK(QuartersOf({9, 6, 0.01}) == Quarters{0});  // half a turn swaps the colours
  CHECK(QuartersOf({7, 7, 0.01}) == Quarters{0, 2});
  CHECK(QuartersOf({8, 8, 0.01}) == Quarters{0, 1, 2, 3});
  CHECK(QuartersOf({9, 6, 0.01, kCircles, 0.004}) == Quarters{0, 2});
  CHECK(QuartersOf({7, 7, 0.01, kCircles, 0.004}) == Quarters{0, 1, 2, 3});
  CHECK(QuartersOf({4, 11, 0.01, kAsymmetricCircles, 0.004}) == Quarters{0});
  CHECK(QuartersOf({8, 8, 0.01, kCharuco, 0.007}) == Quarters{0});
}

TEST_CASE("an S-shaped board held the other way round in some views is one board") {
  for (const target::Board& board :
       {target::Board{17, 11, 0.2 / 17}, target::Board{8, 8, 0.2 / 8},
        target::Board{7, 7, 0.2 / 7, target::BoardKind::kCircles, 1e-4}}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      INFO(WordsOf(board) << ", seed " << seed);
      Random random(seed);
      Conditions conditions = ConditionsFor(board, random);
      MakeSShaped(conditions);
      conditions.bow_per_m = 0.1;
      const SimulatedCapture capture = Simulate(conditions, random);
      std::vector<BoardView> views =
          TurnedViews(board, capture.views, RandomTurns(board, capture.views.size(), random));
      CHECK(TurnsBetween(board, views, capture.views).size() > 1);
      CHECK(Renumber(conditions, views));
      CHECK(TurnsBetween(board, views, capture.views).size() == 1);
      CHECK_FALSE(Renumber(conditions, views));
    }
  }
}

TEST_CASE("one view turned: the others keep their numbers, and the lens is as without the turn") {
  Random random(5);
  Conditions conditions = ConditionsFor({17, 11, 0.2 / 17}, random);
  MakeSShaped(conditions);
  conditions.views = 8;
  const SimulatedCapture capture = Simulate(conditions, random);
  std::vector<std::size_t> turns(capture.views.size(), 0);
  turns[3] = 1;
  const std::vector<BoardView> given = TurnedViews(conditions.board, capture.views, turns);
  std::vector<BoardView> views = given;
  REQUIRE(Renumber(conditions, views));
  CHECK(TurnsBetween(conditions.board, capture.views, views) == std::set<std::size_t>{0});
  const image::ImageSize size{conditions.width, conditions.height};
  const LensCalibration with = CalibrateLens(conditions.board, given, size);
  const LensCalibration without = CalibrateLens(conditions.board, capture.views, size);
  CHECK(with.accepted == without.accepted);
  CHECK(with.lens.fx == Approx(without.lens.fx).epsilon(1e-6));
  CHECK(with.uncertainty.max_px == Approx(without.uncertainty.max_px).epsilon(1e-3));
}

TEST_CASE("a flat and true board, or disturbed views: the order stays as given") {
  for (const char* name :
       {"good", "good, board bowed", "heat haze", "a third of the frames detected wrongly",
        "rolling shutter, board moves down", "paper held in the hand", "board S-shaped"}) {
    int found = 0;
    for (const Kind& kind : AllKinds()) {
      if (kind.name != name) continue;
      ++found;
      for (std::uint64_t seed = 11; seed <= 13; ++seed) {
        INFO(name << ", seed " << seed);
        Random random(seed);
        Conditions conditions = ConditionsFor({17, 11, 0.2 / 17}, random);
        kind.prepare(conditions, random);
        std::vector<BoardView> views = Simulate(conditions, random).views;
        CHECK_FALSE(Renumber(conditions, views));
      }
    }
    REQUIRE(found == 1);
  }
}

TEST_CASE("a flat board held the other way round in places: the claim is the same") {
  Random random(7);
  Conditions conditions = ConditionsFor({17, 11, 0.2 / 17}, random);
  const SimulatedCapture capture = Simulate(conditions, random);
  const image::ImageSize size{conditions.width, conditions.height};
  const LensCalibration straight = CalibrateLens(conditions.board, capture.views, size);
  const LensCalibration turned =
      CalibrateLens(conditions.board,
                    TurnedViews(conditions.board, capture.views,
                                RandomTurns(conditions.board, capture.views.size(), random)),
                    size);
  REQUIRE(straight.accepted);
  CHECK(turned.accepted);
  CHECK(turned.uncertainty.max_px < 1.05 * straight.uncertainty.max_px);
}

}  // namespace plumbline::board_orders_test
