#include "firmware-like/effects/written.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::effects {
namespace {

const ParameterSpec& SpecOf(const EffectTerm& term, const TermParameter& parameter) {
  return term.effect->traits().parameters[parameter.spec];
}

const ParameterSpec* WordSpecOf(const EffectTraits& traits) {
  const auto word = std::ranges::find_if(traits.parameters, [](const ParameterSpec& spec) {
    return spec.role == ParameterRole::kWord;
  });
  return word == traits.parameters.end() ? nullptr : &*word;
}

/// The catalogue's copy of a word, which outlives the file's; the first choice if the word is empty
/// or unknown.
std::string_view CataloguedWord(const ParameterSpec& spec, std::string_view word) {
  const auto choices = Choices(spec.words);
  const auto known = std::ranges::find(choices, word);
  return known == choices.end() ? choices.front() : *known;
}

double FileFromSI(const ParameterSpec& spec, double value) {
  return spec.inverse ? 1 / value : value / spec.to_SI;
}

/// d (file value) / d (SI value), at an SI value.
double FilePerSI(const ParameterSpec& spec, double value) {
  return spec.inverse ? -1 / (value * value) : 1 / spec.to_SI;
}

/// The same for every value of a term.
Eigen::VectorXd FilePerSI(const EffectTerm& term, const std::vector<double>& values) {
  Eigen::VectorXd factors(static_cast<Eigen::Index>(values.size()));
  for (std::size_t k = 0; k < values.size(); ++k) {
    factors[static_cast<Eigen::Index>(k)] = FilePerSI(SpecOf(term, term.parameters[k]), values[k]);
  }
  return factors;
}

/// The stored covariance, or a diagonal one from the standard deviations; empty if neither is
/// complete.
Eigen::MatrixXd CovarianceInFileUnits(const model::WrittenEffect& written) {
  if (written.covariance.size() > 0) return written.covariance;
  std::vector<double> variances;
  for (const model::EffectParameter& parameter : written.parameters) {
    if (!parameter.word.empty()) continue;
    if (!parameter.sd) return {};
    variances.push_back(*parameter.sd * *parameter.sd);
  }
  return Eigen::Map<const Eigen::VectorXd>(variances.data(),
                                           static_cast<Eigen::Index>(variances.size()))
      .asDiagonal();
}

}  // namespace

ActiveEffect ActiveFromWritten(const model::WrittenEffect& written, const model::CellModel& cell) {
  ActiveEffect active;
  const Effect* effect = FindEffect(written.id);
  assert(effect != nullptr);
  const EffectTraits& traits = effect->traits();
  active.term.effect = effect;
  active.term.drivers = written.drivers;
  active.term.nodes = written.nodes;
  active.term.prismatic = PrismaticJoints(cell.robot);
  active.seen_t_s = written.seen_t_s;
  const ParameterSpec* word_spec = WordSpecOf(traits);
  if (word_spec != nullptr) active.term.word = CataloguedWord(*word_spec, {});
  for (const model::EffectParameter& parameter : written.parameters) {
    const auto found = ParameterFromName(traits, parameter.name, cell.robot.size());
    assert(found);
    const ParameterSpec& spec = SpecOf(active.term, *found);
    if (spec.role == ParameterRole::kWord) {
      active.term.word = CataloguedWord(spec, parameter.word);
      continue;
    }
    active.term.parameters.push_back(*found);
    active.values.push_back(spec.inverse ? 1 / parameter.value : parameter.value * spec.to_SI);
  }
  const Eigen::MatrixXd covariance = CovarianceInFileUnits(written);
  if (covariance.size() > 0) {
    const Eigen::VectorXd to_SI = FilePerSI(active.term, active.values).cwiseInverse();
    active.covariance = to_SI.asDiagonal() * covariance * to_SI.asDiagonal();
  }
  return active;
}

std::vector<ActiveEffect> ActiveEffectsOf(const model::CellModel& cell) {
  std::vector<ActiveEffect> effects;
  for (const model::WrittenEffect& written : cell.effects) {
    effects.push_back(ActiveFromWritten(written, cell));
  }
  return effects;
}

model::WrittenEffect WrittenFromActive(const ActiveEffect& active,
                                       const Eigen::MatrixXd& covariance_SI) {
  const EffectTerm& term = active.term;
  const EffectTraits& traits = term.effect->traits();
  model::WrittenEffect written;
  written.id = traits.id;
  written.drivers = term.drivers;
  written.nodes = term.nodes;
  written.seen_t_s = active.seen_t_s;
  if (covariance_SI.size() > 0) {
    const Eigen::VectorXd to_file = FilePerSI(term, active.values);
    written.covariance = to_file.asDiagonal() * covariance_SI * to_file.asDiagonal();
  }
  std::vector<int> joints;
  for (std::size_t k = 0; k < active.values.size(); ++k) {
    const TermParameter& parameter = term.parameters[k];
    const ParameterSpec& spec = SpecOf(term, parameter);
    model::EffectParameter& file = written.parameters.emplace_back();
    file.name = NameFromParameter(traits, parameter);
    file.value = FileFromSI(spec, active.values[k]);
    file.unit = UnitOf(spec, term.prismatic, parameter.joint);
    const auto row = static_cast<Eigen::Index>(k);
    if (written.covariance.size() > 0) file.sd = std::sqrt(written.covariance(row, row));
    if (parameter.joint >= 0) joints.push_back(parameter.joint);
  }
  if (const ParameterSpec* spec = WordSpecOf(traits)) {
    model::EffectParameter& file = written.parameters.emplace_back();
    file.name = spec->name;
    file.word = CataloguedWord(*spec, term.word);
  }
  std::ranges::sort(joints);
  joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
  for (const int joint : joints) written.scope.push_back("q" + std::to_string(joint + 1));
  return written;
}

bool FollowsTime(const EffectTerm& term) {
  return term.effect->traits().Needs(Signal::kTime, term.word) ||
         std::ranges::find(term.drivers, "t_s") != term.drivers.end();
}

bool ReadsTime(const EffectTerm& term) {
  const bool from_a_moment_on = std::ranges::any_of(term.parameters, [&](const TermParameter& own) {
    return IsEventTime(SpecOf(term, own)) && SpecOf(term, own).name == "time";
  });
  return from_a_moment_on || FollowsTime(term);
}

std::optional<double> ClampedToFittedTime(const ActiveEffect& effect, std::optional<double> t_s) {
  if (!t_s || !effect.seen_t_s) return t_s;
  return std::clamp(*t_s, effect.seen_t_s->low, effect.seen_t_s->high);
}

void AddEffects(std::span<const ActiveEffect> effects, const Conditions& conditions,
                Influence<double>& influence) {
  for (const ActiveEffect& effect : effects) {
    if (const auto t_s = ClampedToFittedTime(effect, conditions.t_s); t_s != conditions.t_s) {
      Conditions held = conditions;
      held.t_s = t_s;
      effect.term.effect->Add(effect.term, effect.values, held, influence);
    } else {
      effect.term.effect->Add(effect.term, effect.values, conditions, influence);
    }
  }
}

}  // namespace plumbline::effects
