#include "firmware-like/effects/written.h"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <new>

#include "firmware-like/effects/event_time_uncertainty.h"
#include "tests/firmware-like/effects/any_term.h"
#include "tests/firmware-like/effects/small_cell.h"

namespace {

long g_allocations = 0;

}  // namespace

// Sanitizers replace the allocator; allocations are not counted there.
#ifndef PLUMBLINE_SANITIZED
void* operator new(std::size_t size) {
  ++g_allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}
#endif

namespace plumbline::written_test {

using namespace plumbline::effects;

namespace {

std::vector<const Effect*> AllEffects() {
  std::vector<const Effect*> effects(Catalogue().begin(), Catalogue().end());
  effects.push_back(&Empirical());
  return effects;
}

/// A covariance of n values of very different size.
Eigen::MatrixXd AnyCovariance(const std::vector<double>& values) {
  const auto n = static_cast<Eigen::Index>(values.size());
  const Eigen::MatrixXd A = Eigen::MatrixXd::Random(n, n);
  const Eigen::VectorXd sizes = 0.01 * Eigen::Map<const Eigen::VectorXd>(values.data(), n);
  return sizes.asDiagonal() * (A * A.transpose()) * sizes.asDiagonal();
}

TEST_CASE("an event time is uncertain between the two rows around it, and nowhere else") {
  std::mt19937 random(3);
  int moments = 0;
  for (const Effect* effect : AllEffects()) {
    CAPTURE(effect->traits().id);
    for (const EffectTerm& term : AnyTerms(*effect)) {
      ActiveEffect active{term, AnyValues(term, random), {}};
      const auto count = static_cast<Eigen::Index>(active.values.size());
      const auto& specs = effect->traits().parameters;
      for (std::size_t k = 0; k < active.values.size(); ++k) {
        const ParameterSpec& spec = specs[static_cast<std::size_t>(term.parameters[k].spec)];
        if (!IsEventTime(spec)) continue;
        ++moments;
        active.covariance = Eigen::MatrixXd::Zero(count, count);
        const auto at = static_cast<Eigen::Index>(k);
        active.covariance(at, at) = 100 * 100 / 12.0;  // rows that are 100 apart
        const auto uncertainty_at = [&](double moment) {
          Conditions conditions;
          (spec.name == "row" ? conditions.row : conditions.t_s) = moment;
          return UncertaintyOfEventTime(active, conditions);
        };
        REQUIRE(uncertainty_at(active.values[k] + 49));
        CHECK(uncertainty_at(active.values[k] - 49)->is_row == (spec.name == "row"));
        CHECK(uncertainty_at(active.values[k])->between.high == Approx(active.values[k] + 50));
        CHECK_FALSE(uncertainty_at(active.values[k] + 51));
        CHECK_FALSE(uncertainty_at(active.values[k] - 51));
        CHECK_FALSE(UncertaintyOfEventTime(active, Conditions{}));
        active.covariance.resize(0, 0);
        CHECK_FALSE(uncertainty_at(active.values[k]));
      }
    }
  }
  CHECK(moments >= 2);
}

TEST_CASE("An active effect of every id survives a round trip through the file form") {
  std::mt19937 random(3);
  for (const Effect* effect : AllEffects()) {
    CAPTURE(effect->traits().id);
    for (const EffectTerm& term : AnyTerms(*effect)) {
      CAPTURE(term.word);
      ActiveEffect active;
      active.term = term;
      active.values = AnyValues(term, random);
      active.covariance = AnyCovariance(active.values);
      const model::WrittenEffect written = WrittenFromActive(active, active.covariance);
      const ActiveEffect again = ActiveFromWritten(written, SmallCell());
      CHECK(again.term.effect == effect);
      CHECK(again.term.word == term.word);
      CHECK(again.term.parameters == term.parameters);
      CHECK(again.term.drivers == term.drivers);
      CHECK(again.term.nodes == term.nodes);
      REQUIRE(again.values.size() == active.values.size());
      for (std::size_t k = 0; k < again.values.size(); ++k) {
        CHECK(again.values[k] == Approx(active.values[k]).epsilon(1e-14));
      }
      CHECK(again.covariance.isApprox(active.covariance, 1e-12));
      for (const model::EffectParameter& parameter : written.parameters) {
        CAPTURE(parameter.name);
        const auto found = ParameterFromName(effect->traits(), parameter.name, 6);
        REQUIRE(found);
        const auto& spec = effect->traits().parameters[static_cast<std::size_t>(found->spec)];
        CHECK(parameter.unit == spec.unit);
        CHECK(parameter.word.empty() == (spec.role != ParameterRole::kWord));
        CHECK(parameter.sd.has_value() == parameter.word.empty());
      }
    }
  }
}

TEST_CASE("Names, units and scope follow the file formats") {
  ActiveEffect active;
  active.term.effect = FindEffect("gear_periodic");
  active.term.parameters = {{0, 2, 1}, {5, 2, 2}, {0, 0, 1}};
  active.values = {1e-4, 0.5, 2e-4};
  model::WrittenEffect written = WrittenFromActive(active, {});
  CHECK(written.scope == std::vector<std::string>{"q1", "q3"});
  CHECK(written.parameters[0].name == "q3_amplitude");
  CHECK(written.parameters[1].name == "q3_2_phase");
  CHECK(written.parameters[1].unit == "rad");
  CHECK_FALSE(written.parameters[0].sd);
  CHECK(written.covariance.size() == 0);

  active.term = {FindEffect("link_geometry"), {{0, 1, 1}, {2, 3, 1}}};
  active.values = {1e-3, 0.017453292519943295};
  written = WrittenFromActive(active, Eigen::Vector2d(1e-12, 1e-12).asDiagonal());
  CHECK(written.parameters[0].name == "a2");
  CHECK(written.parameters[0].value == Approx(1.0));
  CHECK(*written.parameters[0].sd == Approx(1e-3));
  CHECK(written.parameters[1].name == "alpha4");
  CHECK(written.parameters[1].value == Approx(1.0));
  CHECK(written.scope == std::vector<std::string>{"q2", "q4"});

  active.term = {FindEffect("step_event"), {{0, -1, 1}, {2, -1, 1}}, "tool"};
  active.values = {600, 1e-3};
  written = WrittenFromActive(active, {});
  CHECK(written.scope.empty());
  CHECK(written.parameters.back().name == "frame");
  CHECK(written.parameters.back().word == "tool");
}

TEST_CASE("the standard deviation of kappa is converted by the delta method") {
  ActiveEffect active;
  active.term = {FindEffect("tool_shear"), {{0, -1, 1}}};
  active.values = {2.0};
  const model::WrittenEffect written =
      WrittenFromActive(active, Eigen::MatrixXd::Constant(1, 1, 0.2 * 0.2));
  CHECK(written.parameters[0].value == 0.5);
  CHECK(*written.parameters[0].sd == Approx(0.2 / 4));  // d(1/v) = dv / v^2
}

TEST_CASE("Standard deviations replace a covariance only if every number has one") {
  model::WrittenEffect written;
  written.id = "backlash";
  written.parameters = {{.name = "q1", .value = 1e-4, .sd = 1e-5, .unit = "rad", .word = ""},
                        {.name = "by", .value = 0, .sd = {}, .unit = "", .word = "move"},
                        {.name = "q2", .value = 2e-4, .sd = 3e-5, .unit = "rad", .word = ""}};
  const ActiveEffect active = ActiveFromWritten(written, SmallCell());
  CHECK(active.term.word == "move");
  REQUIRE(active.covariance.rows() == 2);
  CHECK(active.covariance(0, 0) == Approx(1e-10));
  CHECK(active.covariance(1, 1) == Approx(9e-10));
  CHECK(active.covariance(0, 1) == 0);
  written.parameters[2].sd.reset();
  CHECK(ActiveFromWritten(written, SmallCell()).covariance.size() == 0);
}

TEST_CASE("Effects of a cell keep their order, and adding them does not allocate") {
  std::mt19937 random(5);
  model::CellModel cell = SmallCell();
  for (const Effect* effect : AllEffects()) {
    for (const EffectTerm& term : AnyTerms(*effect)) {
      cell.effects.push_back(WrittenFromActive({term, AnyValues(term, random), {}}, {}));
    }
  }
  const std::vector<ActiveEffect> effects = ActiveEffectsOf(cell);
  REQUIRE(effects.size() == cell.effects.size());
  CHECK(effects.front().term.effect->traits().id == "base_frame");
  const Conditions moment = KnownMoment();
  Influence<double> influence;
  const long before = g_allocations;
  AddEffects(effects, moment, influence);
  const long after = g_allocations;
  CHECK(after == before);
  CHECK(influence[Influence<double>::kScale] != 0);
}

}  // namespace
}  // namespace plumbline::written_test
