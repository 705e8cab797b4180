// Causes that no catalogue lists: effects of one group of rows, curves, and rejected rows.
#include <algorithm>
#include <catch2/catch.hpp>

#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::open_world_test {

using namespace plumbline::measure;

MeasuredCell NoEffect(unsigned seed) {
  MeasuredCell data =
      Simulated("--family none --robot ur10 --rows 90 --seed 5 --sigma-mm 0.05 --repeats 10");
  Remeasure(data, {}, 5e-5, seed);
  return data;
}

Diagnosis Answer(const MeasuredCell& data) {
  const auto diagnosis = DiagnoseRows(data.cell, data.table, {});
  REQUIRE(diagnosis);
  return *diagnosis;
}

bool Names(const std::vector<std::string>& texts, const std::string& part) {
  return std::ranges::any_of(
      texts, [&](const std::string& text) { return text.find(part) != std::string::npos; });
}

/// Moves the rows for which `affected(k)` holds by an effect.
template <typename Affected>
void Move(MeasuredCell& data, const effects::ActiveEffect& effect, const Affected& affected) {
  const std::vector<Vec3> moved = DisplacementBy(data, {effect});
  for (std::size_t k = 0; k < moved.size(); ++k) {
    if (affected(k)) *data.table.rows[k].measured_W += moved[k];
  }
}

/// Divides the rows into two sessions, the second half a day later.
/// @return  the first row of the second session
std::size_t Divide(MeasuredCell& data) {
  data.table.recorded.session = true;
  const std::size_t half = data.table.rows.size() / 2;
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    data.table.rows[k].session = k < half ? "1" : "2";
    if (k >= half) *data.table.rows[k].t_s += 43200;
  }
  return half;
}

TEST_CASE("an effect of one session only is driven by the session") {
  MeasuredCell data = NoEffect(11);
  const std::size_t half = Divide(data);
  Move(data, EffectWith(data.cell, "gear_ratio", {{"q3", 2e-3}}),
       [&](std::size_t k) { return k >= half; });
  const Diagnosis diagnosis = Answer(data);
  CHECK(diagnosis.verdict == Verdict::kUnknown);
  CHECK(Names(diagnosis.drivers, "session"));
}

TEST_CASE("a joint's zero that jumped between two sessions is explained, whatever the clock does") {
  for (const bool restarts : {false, true}) {
    CAPTURE(restarts);
    MeasuredCell data = NoEffect(11);
    const std::size_t half = Divide(data);
    const double restart_s = *data.table.rows[half].t_s;
    for (std::size_t k = half; k < data.table.rows.size() && restarts; ++k)
      *data.table.rows[k].t_s -= restart_s;
    Move(data, EffectWith(data.cell, "joint_offset", {{"q5", 2e-3}, {"q3", 4e-4}}),
         [&](std::size_t k) { return k >= half; });
    const Diagnosis diagnosis = Answer(data);
    CHECK(diagnosis.verdict == Verdict::kExplained);
    CHECK(diagnosis.drivers.empty());
    REQUIRE(diagnosis.findings.size() == 1);
    const effects::ActiveEffect& jump = diagnosis.findings[0].effect;
    CHECK(jump.term.effect->traits().id == "offset_event");
    REQUIRE(jump.values.size() == 3);            // the event time, and two joints
    const auto row = static_cast<double>(half);  // number of the last one of the first session
    const auto& rows = data.table.rows;
    CHECK(jump.values[0] > (restarts ? row : *rows[half - 1].t_s));
    CHECK(jump.values[0] < (restarts ? row + 1 : *rows[half].t_s));
    CHECK(jump.values[1] == Approx(4e-4).epsilon(0.1));
    CHECK(jump.values[2] == Approx(2e-3).epsilon(0.1));
  }
}

TEST_CASE("rejected rows that one effect explains are no gross errors") {
  for (const bool regime : {true, false}) {
    CAPTURE(regime);
    MeasuredCell data = NoEffect(12);
    const auto affected = [](std::size_t k) { return k % 13 == 6; };
    if (regime) {
      Move(data, EffectWith(data.cell, "joint_offset", {{"q3", 2e-3}}), affected);
    } else {  // the same rows, each in a direction of its own
      for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
        const auto angle = static_cast<double>(k * k);
        const Vec3 error(std::sin(angle), std::cos(3 * angle), std::sin(5 * angle));
        if (affected(k)) *data.table.rows[k].measured_W += 2e-3 * error;
      }
    }
    const Diagnosis diagnosis = Answer(data);
    CHECK(diagnosis.outlier_rows.size() >= 4);
    CHECK(Names(diagnosis.notes, "are hardly gross errors") == regime);
    CHECK((diagnosis.verdict == Verdict::kUnknown) == regime);
  }
}

TEST_CASE("an effect that acts in all sessions is not said to depend on them") {
  MeasuredCell data = NoEffect(13);
  data.table.recorded.session = true;
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    data.table.rows[k].session = k % 2 == 0 ? "1" : "2";
  }
  Move(data, EffectWith(data.cell, "gear_ratio", {{"q2", 2e-3}}), [](std::size_t) { return true; });
  const Diagnosis diagnosis = Answer(data);
  CHECK(diagnosis.verdict == Verdict::kExplained);
  CHECK(diagnosis.drivers.empty());
}

}  // namespace plumbline::open_world_test
