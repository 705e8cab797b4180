// Lost measurements and lost lines: the answer must be that of the complete data.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>

#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/table/conditions.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::partial_rows_test {

using namespace plumbline::measure;

namespace {

enum class Loss {
  kPoints,  ///< measured cells are empty, joints are present
  kLines,   ///< whole lines, detectable by a row counter
};

/// A table with a share of its measurements removed.
measure::MeasuredTable Losing(const measure::MeasuredTable& table, Loss loss, double share,
                              unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  measure::MeasuredTable left = table;
  left.rows.clear();
  bool lost_before = false;
  for (const measure::MeasuredRow& row : table.rows) {
    const bool lost = uniform(generator) < share;
    if (!lost) {
      if (lost_before && loss == Loss::kLines) left.breaks.push_back(row.line);
      left.rows.push_back(row);
    } else if (loss == Loss::kPoints) {
      left.unmeasured.push_back(row);
    }
    lost_before = lost;
  }
  return left;
}

Diagnosis Answer(const model::CellModel& cell, const measure::MeasuredTable& table) {
  DiagnosisOptions options;
  options.bootstrap = 10;
  const Result<Diagnosis> diagnosis = Diagnose(cell, table, options);
  REQUIRE(diagnosis);
  return *diagnosis;
}

/// True if the effects are equal and their values differ by at most 2 % (of the largest of an
/// effect).
void CheckSame(const Diagnosis& full, const Diagnosis& left) {
  REQUIRE(left.findings.size() == full.findings.size());
  for (std::size_t f = 0; f < full.findings.size(); ++f) {
    const effects::ActiveEffect& whole = full.findings[f].effect;
    const effects::ActiveEffect& part = left.findings[f].effect;
    CHECK(part.term.effect == whole.term.effect);
    CHECK(part.term.word == whole.term.word);
    REQUIRE(part.values.size() == whole.values.size());
    double largest = 0;
    for (const double value : whole.values) largest = std::max(largest, std::abs(value));
    for (std::size_t k = 0; k < whole.values.size(); ++k) {
      CHECK(part.values[k] == Approx(whole.values[k]).margin(0.02 * largest));
    }
  }
}

}  // namespace

TEST_CASE("lost measurements do not change effects of the last move") {
  for (const char* family : {"backlash_move", "approach_lag"}) {
    for (const int seed : {21, 22}) {
      const MeasuredCell data =
          Simulated(fmt::format("--family {} --robot kr210 --signal 40 --seed {}", family, seed));
      const Diagnosis full = Answer(data.cell, data.table);
      REQUIRE(full.verdict == Verdict::kExplained);
      for (const Loss loss : {Loss::kPoints, Loss::kLines}) {
        const double share = loss == Loss::kPoints ? 0.3 : 0.15;
        CAPTURE(family, seed, share);
        const Diagnosis left = Answer(data.cell, Losing(data.table, loss, share, 4));
        CHECK(left.verdict == Verdict::kExplained);
        CheckSame(full, left);
      }
    }
  }
}

TEST_CASE("rows after lost lines are used for effects independent of the last move") {
  const MeasuredCell data =
      Simulated("--family joint_compliance --robot ur10 --signal 20 --seed 23");
  const measure::MeasuredTable table = Losing(data.table, Loss::kLines, 0.15, 4);
  REQUIRE(LackedSignals(data.cell, table).size() == 1);
  const Diagnosis left = Answer(data.cell, table);
  CHECK(left.verdict == Verdict::kExplained);
  CHECK(left.rows.size() == table.rows.size());
}

TEST_CASE("a row without a measurement still counts as a move; a gap in the order does not") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 12 --repeats 0 --seed 4");
  const std::vector<effects::Conditions> whole = ConditionsOf(data.cell, data.table);
  measure::MeasuredTable table = data.table;
  table.unmeasured = {table.rows[4], table.rows[5]};
  table.rows.erase(table.rows.begin() + 4, table.rows.begin() + 6);
  const std::vector<effects::Conditions> kept = ConditionsOf(data.cell, table);
  CHECK(kept[4].last_move == whole[6].last_move);
  CHECK(kept[4].approach == whole[6].approach);
  table.breaks = {table.rows[4].line};
  const std::vector<effects::Conditions> broken = ConditionsOf(data.cell, table);
  CHECK(broken[4].last_move.size() == 0);
  CHECK(broken[5].last_move == whole[7].last_move);
}

}  // namespace plumbline::partial_rows_test
