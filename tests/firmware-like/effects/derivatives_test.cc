// Values and derivatives of every effect: Dual against double and against central differences.
#include <catch2/catch.hpp>
#include <random>

#include "tests/firmware-like/effects/any_term.h"
#include "tests/firmware-like/effects/small_cell.h"

namespace plumbline::derivatives_test {

using namespace plumbline::effects;

namespace {

using I = Influence<double>;

model::JointVector AnyJoints(double size, std::mt19937& random) {
  std::uniform_real_distribution<double> draw(-size, size);
  model::JointVector joints(6);
  for (double& joint : joints) joint = draw(random);
  return joints;
}

/// @param camera  that measured, for the effects of one camera
Conditions AnyMoment(std::mt19937& random, std::string_view camera) {
  std::uniform_real_distribution<double> draw(0, 1);
  model::CellModel cell = SmallCell();
  for (model::Joint& joint : cell.robot.joints) joint.alpha_rad = 0.4;  // gravity across every axis
  Conditions moment = DeclaredConditions(cell);
  moment.further = {{"tilt_x_deg", draw(random)}, {"tilt_y_deg", draw(random)}};
  moment.q = AnyJoints(3, random);
  moment.qd = AnyJoints(2, random);
  moment.qdd = AnyJoints(5, random);
  moment.last_move = AnyJoints(2, random);
  moment.approach = AnyJoints(1, random).cwiseSign();
  moment.tau = AnyJoints(500, random);
  moment.payload_kg = 80 * draw(random);
  moment.t_s = 1500 * draw(random);
  moment.temp_C = 15 + 20 * draw(random);
  moment.camera_name = camera;
  moment.row = 1 + std::floor(2e6 * draw(random));
  return moment;
}

I Sum(const EffectTerm& term, const std::vector<double>& values, const Conditions& moment) {
  I influence;
  term.effect->Add(term, values, moment, influence);
  return influence;
}

Influence<Dual> DualSum(const EffectTerm& term, const std::vector<double>& values,
                        const Conditions& moment) {
  std::vector<Dual> duals;
  duals.reserve(values.size());
  for (const double value : values) duals.emplace_back(value, static_cast<int>(duals.size()));
  Influence<Dual> influence;
  term.effect->Add(term, std::span<const Dual>(duals), moment, influence);
  return influence;
}

/// Step of a central difference: relative to the value, or large enough to change a phase.
double StepOf(const EffectTerm& term, std::size_t k, double value) {
  const auto& spec =
      term.effect->traits().parameters[static_cast<std::size_t>(term.parameters[k].spec)];
  if (spec.unit == "s" && spec.role == ParameterRole::kShape) return 1e-4 * value;
  return spec.role == ParameterRole::kShape ? 1e-5 : 1e-4 * (spec.plausible.high * spec.to_SI);
}

void CheckDerivatives(const EffectTerm& term, std::mt19937& random) {
  const Conditions moment = AnyMoment(random, term.word);
  const std::vector<double> values = AnyValues(term, random);
  const I influence = Sum(term, values, moment);
  const Influence<Dual> dual = DualSum(term, values, moment);
  for (int entry = 0; entry < I::kSize; ++entry) CHECK(dual[entry].a == influence[entry]);
  for (std::size_t k = 0; k < values.size(); ++k) {
    CAPTURE(k, values[k]);
    const double step = StepOf(term, k, values[k]);
    std::vector<double> more = values, less = values;
    more[k] += step;
    less[k] -= step;
    const I above = Sum(term, more, moment), below = Sum(term, less, moment);
    for (int entry = 0; entry < I::kSize; ++entry) {
      CAPTURE(entry);
      const double slope = (above[entry] - below[entry]) / (more[k] - less[k]);
      const double derivative = dual[entry].v[static_cast<Eigen::Index>(k)];
      // Allows for rounding in the difference where the derivative nearly vanishes.
      const double rounding = 1e-12 * std::abs(influence[entry]) / step;
      CHECK(std::abs(derivative - slope) <= 1e-6 * std::abs(derivative) + rounding);
    }
  }
}

TEST_CASE("Dual and double agree, and derivatives match central differences") {
  std::mt19937 random(20261121);
  std::vector<const Effect*> effects(Catalogue().begin(), Catalogue().end());
  effects.push_back(&Empirical());
  for (const Effect* effect : effects) {
    CAPTURE(effect->traits().id);
    for (const EffectTerm& term : AnyTerms(*effect)) {
      CAPTURE(term.word);
      REQUIRE(term.parameters.size() <= static_cast<std::size_t>(kDualWidth));
      for (int draw = 0; draw < 50; ++draw) CheckDerivatives(term, random);
    }
  }
}

TEST_CASE("A linear size has the effect predicted by its derivative at zero") {
  std::mt19937 random(11);
  for (const Effect* effect : Catalogue()) {
    CAPTURE(effect->traits().id);
    for (const EffectTerm& term : AnyTerms(*effect)) {
      const auto spec = [&](std::size_t k) -> const ParameterSpec& {
        return effect->traits().parameters[static_cast<std::size_t>(term.parameters[k].spec)];
      };
      for (int draw = 0; draw < 50; ++draw) {
        const Conditions moment = AnyMoment(random, term.word);
        std::vector<double> values = AnyValues(term, random);
        for (std::size_t k = 0; k < values.size(); ++k) {
          if (spec(k).role == ParameterRole::kSize) values[k] = 0;
        }
        const Influence<Dual> dual = DualSum(term, values, moment);
        for (std::size_t k = 0; k < values.size(); ++k) {
          if (spec(k).role != ParameterRole::kSize || spec(k).value_of_linear != nullptr) continue;
          CAPTURE(k);
          values[k] = 1;
          const I influence = Sum(term, values, moment);
          values[k] = 0;
          for (int entry = 0; entry < I::kSize; ++entry) {
            CAPTURE(entry);
            const double slope = dual[entry].v[static_cast<Eigen::Index>(k)];
            CHECK(std::abs(influence[entry] - slope) <= 1e-12 * std::abs(slope));
          }
        }
      }
    }
  }
}

TEST_CASE("Every parameter of every effect moves the arm under some conditions") {
  std::mt19937 random(7);
  std::vector<const Effect*> effects(Catalogue().begin(), Catalogue().end());
  effects.push_back(&Empirical());
  for (const Effect* effect : effects) {
    CAPTURE(effect->traits().id);
    for (const EffectTerm& term : AnyTerms(*effect)) {
      std::vector<bool> moves(term.parameters.size(), false);
      for (int draw = 0; draw < 20; ++draw) {
        const auto dual = DualSum(term, AnyValues(term, random), AnyMoment(random, term.word));
        for (int entry = 0; entry < I::kSize; ++entry) {
          for (std::size_t k = 0; k < moves.size(); ++k) {
            moves[k] = moves[k] || dual[entry].v[static_cast<Eigen::Index>(k)] != 0;
          }
        }
      }
      for (std::size_t k = 0; k < moves.size(); ++k) {
        CAPTURE(k);
        const bool is_moment = IsEventTime(
            effect->traits().parameters[static_cast<std::size_t>(term.parameters[k].spec)]);
        CHECK(moves[k] != is_moment);
      }
    }
  }
}

}  // namespace
}  // namespace plumbline::derivatives_test
