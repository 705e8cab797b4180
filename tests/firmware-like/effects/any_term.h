// Test terms of every effect with all parameters in use and values from the plausible ranges.
#pragma once

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/empirical.h"
#include "firmware-like/effects/parameter_name.h"
#include "firmware-like/effects/written.h"

namespace plumbline::effects {

/// One term per word (or one term without a word), with each parameter once, or for joints 2 and 4;
/// repeatable parameters also as the second and third term of joint 2.
inline std::vector<EffectTerm> AnyTerms(const Effect& effect) {
  EffectTerm term;
  term.effect = &effect;
  std::vector<std::string_view> words = {""};
  const auto& specs = effect.traits().parameters;
  for (int spec = 0; spec < static_cast<int>(specs.size()); ++spec) {
    const ParameterSpec& of = specs[static_cast<std::size_t>(spec)];
    const auto first = of.name.find('#');
    if (of.role == ParameterRole::kWord) {
      words = Choices(of.words);
    } else if (first == std::string_view::npos) {
      term.parameters.push_back({spec, -1, 1});
    } else if (IsOfTwoJoints(of)) {
      term.parameters.push_back({spec, 1, 1, 0});
      term.parameters.push_back({spec, 3, 1, 1});
    } else if (IsOfJointAndLink(of)) {
      term.parameters.push_back({spec, 1, 1, 1});
      term.parameters.push_back({spec, 1, 1, 4});
    } else if (of.name.find('#', first + 1) == std::string_view::npos) {
      term.parameters.push_back({spec, 1, 1});
      term.parameters.push_back({spec, 3, 1});
    } else {
      term.parameters.push_back({spec, 1, 2});
      term.parameters.push_back({spec, 1, 3});
    }
  }
  if (&effect == &Empirical()) {
    term.drivers = {"t_s"};
    term.nodes.setRandom(4, static_cast<Eigen::Index>(term.parameters.size()) + 1);
    term.nodes.col(0) << 0, 100, 900, 2000;
  }
  std::vector<EffectTerm> terms;
  for (const std::string_view word : words) {
    terms.push_back(term);
    terms.back().word = word;
  }
  return terms;
}

/// Values in SI units; a time constant is drawn on a logarithmic scale.
inline std::vector<double> AnyValues(const EffectTerm& term, std::mt19937& random) {
  std::vector<double> values;
  for (const TermParameter& parameter : term.parameters) {
    const ParameterSpec& spec =
        term.effect->traits().parameters[static_cast<std::size_t>(parameter.spec)];
    const auto [low, high] = spec.plausible;
    const bool decades = low > 0 && high / low > 1000;
    std::uniform_real_distribution<double> draw(decades ? std::log(low) : low,
                                                decades ? std::log(high) : high);
    const double value = decades ? std::exp(draw(random)) : draw(random);
    values.push_back(spec.inverse ? 1 / value : value * spec.to_SI);
  }
  return values;
}

}  // namespace plumbline::effects
