#include "app/diagnosis/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "app/diagnosis/empirical_bounds.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/thresholds.h"
#include "firmware-like/effects/parameter_name.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline {
namespace {

constexpr std::size_t kMostRefits = 8;

std::string FileNumber(double value) {
  return fmt::format("{:.3g}", value);
}

/// A value outside its range, as a multiple of the bound that it passes.
double TimesBeyond(const Interval& range, double value) {
  const double bound = value > range.high ? range.high : range.low;
  return bound * value > 0 ? value / bound : HUGE_VAL;
}

struct Implausible {
  std::string sentence;
  double times = 0;
};

/// The first value that a sound machine does not show.
Implausible ImplausibilityOf(const Dataset& data, const ActiveEffect& effect) {
  const EffectTraits& traits = effect.term.effect->traits();
  if (traits.empirical) return {};
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const TermParameter& parameter = effect.term.parameters[k];
    const ParameterSpec& spec = traits.parameters[static_cast<std::size_t>(parameter.spec)];
    if (spec.role != ParameterRole::kSize) continue;
    const double in_file = spec.inverse ? 1 / effect.values[k] : effect.values[k] / spec.to_SI;
    const std::uint32_t prismatic = effect.term.prismatic;
    const std::string_view unit = UnitOf(spec, prismatic, parameter.joint);
    const Interval& plausible = PlausibleOf(spec, prismatic, parameter.joint);
    if (!plausible.Contains(in_file)) {
      return {fmt::format("{} = {} {} is outside {}..{}, what a sound machine shows",
                          NameFromParameter(traits, parameter), FileNumber(in_file), unit,
                          FileNumber(plausible.low), FileNumber(plausible.high)),
              TimesBeyond(plausible, in_file)};
    }
    if (traits.adds_compliance) {
      const double declared = data.cell.robot.joints[static_cast<std::size_t>(parameter.joint)]
                                  .compliance_rad_per_Nm.value_or(0);
      if (declared + effect.values[k] < 0) {
        return {fmt::format("joint q{} would yield against its load: its whole compliance would be "
                            "negative ({} {})",
                            parameter.joint + 1, FileNumber(declared + effect.values[k]), unit),
                HUGE_VAL};
      }
    }
  }
  return {};
}

/// Shapes and choices of joints among which the blocks of an effect were found.
double Trials(const Pool& pool, const Explanation& explanation,
              const std::vector<BlockIndex>& blocks) {
  double trials = 1;
  for (const BlockIndex block : blocks) {
    const Block& of = pool.blocks()[block];
    trials *= std::max(1.0, of.trials) * std::exp(pool.LogChoices(explanation, block));
  }
  return trials;
}

}  // namespace

bool Writable(const Finding& finding) {
  constexpr double kBeyondMeasure = 1e11;
  const WrittenEffect written = WrittenFromActive(finding.effect, finding.covariance);
  return written.covariance.allFinite() &&
         (written.covariance.size() == 0 ||
          written.covariance.cwiseAbs().maxCoeff() < kBeyondMeasure);
}

void AddFindings(const FindingsContext& context, Diagnosis& diagnosis) {
  const Pool& pool = context.pool;
  const Dataset& data = context.problem.data;
  const auto& effects = context.refit.model.effects;
  const double freedom =
      std::max(1.0, pool.problem().freedom() - static_cast<double>(context.best.columns.size()));
  // A fit that leaves more than noise is less sure than its formal covariance.
  const double inflation = std::max(1.0, context.best.chi2 / freedom);
  const auto count = static_cast<int>(context.refit.parameters.size());
  for (std::size_t e = 0; e < effects.size(); ++e) {
    Finding finding;
    finding.effect = effects[e];
    const std::string id(effects[e].term.effect->traits().id);
    std::vector<int> places(effects[e].values.size(), -1);
    for (int j = 0; j < count; ++j) {
      if (context.refit.parameters[static_cast<std::size_t>(j)].first == static_cast<int>(e)) {
        places[static_cast<std::size_t>(
            context.refit.parameters[static_cast<std::size_t>(j)].second)] = j;
      }
    }
    const auto size = static_cast<int>(places.size());
    finding.covariance = Eigen::MatrixXd::Zero(size, size);
    for (int i = 0; i < size; ++i) {
      for (int j = 0; j < size; ++j) {
        const int a = places[static_cast<std::size_t>(i)], b = places[static_cast<std::size_t>(j)];
        if (a >= 0 && b >= 0) finding.covariance(i, j) = inflation * context.refit.covariance(a, b);
      }
    }
    const EffectKey key{id, std::string(effects[e].term.word)};
    const std::vector<BlockIndex> own = pool.BlocksOf(context.best, key);
    const Explanation without = pool.Fit(pool.BlocksBeside(context.best, key));
    const double drop = std::max(0.0, without.chi2 - context.best.chi2);
    const double columns = std::max<double>(1, static_cast<double>(context.best.columns.size()) -
                                                   static_cast<double>(without.columns.size()));
    finding.p_value = std::min(1.0, EffectsConsidered(data) * Trials(pool, context.best, own) *
                                        ChiSquareTail(drop / inflation, columns));
    finding.share_of_residual = drop / std::max(1e-12, pool.chi2_null());
    const Implausible implausible = ImplausibilityOf(data, effects[e]);
    finding.implausible = implausible.sentence;
    finding.implausible_times = implausible.times;
    if (FollowsTime(effects[e].term) && data.table.recorded.time) {
      Interval seen{1e300, -1e300};
      for (const RowIndex row : data.row_indices()) {
        if (context.problem.weights[row] < kOutlierWeight) continue;
        const double t_s = data.measured(row).t_s;
        seen.low = std::min(seen.low, t_s);
        seen.high = std::max(seen.high, t_s);
      }
      finding.effect.seen_t_s = seen;
    }
    if (effects[e].term.effect->traits().empirical) {
      // Stein's factor: a curve fitted to noise alone would be shrunk to nothing.
      const double factor = std::max(0.0, 1 - std::max(0.0, columns - 2) / std::max(drop, 1e-9));
      for (double& value : finding.effect.values) value *= factor;
      BoundToRows(context.problem, pool.problem().linear(), finding.effect);
      const double sd = 1 / std::sqrt(std::max(drop, 1.0));
      finding.covariance = Eigen::MatrixXd::Identity(size, size) * sd * sd;
    } else if (BeginsAtAMoment(effects[e].term)) {
      // The moment lies somewhere between two rows.
      std::vector<double> times;
      for (const Conditions& moment : data.conditions) {
        times.push_back(data.table.recorded.time ? moment.t_s.value_or(0) : moment.row.value_or(0));
      }
      std::sort(times.begin(), times.end());
      const auto next = std::upper_bound(times.begin(), times.end(), finding.effect.values.front());
      if (next != times.begin() && next != times.end()) {
        const double gap = *next - *(next - 1);
        finding.covariance(0, 0) = gap * gap / 12;
      }
    }
    const bool held = std::all_of(places.begin(), places.end(), [&](int place) {
      return place < 0 || context.refit.held[static_cast<std::size_t>(place)];
    });
    if (!held || !Writable(finding)) finding.covariance.resize(0, 0);
    diagnosis.findings.push_back(std::move(finding));
  }
  for (int j = 0; j < count; ++j) {
    const auto [e, k] = context.refit.parameters[static_cast<std::size_t>(j)];
    const ActiveEffect& effect = effects[static_cast<std::size_t>(e)];
    diagnosis.finding_names.push_back(
        fmt::format("{} {}", effect.term.effect->traits().id,
                    NameFromParameter(effect.term.effect->traits(),
                                      effect.term.parameters[static_cast<std::size_t>(k)])));
  }
  diagnosis.correlation = Eigen::MatrixXd::Identity(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const double scale =
          std::sqrt(context.refit.covariance(i, i) * context.refit.covariance(j, j));
      if (i != j && scale > 0) diagnosis.correlation(i, j) = context.refit.covariance(i, j) / scale;
    }
  }
}

std::vector<Explanation> AddRivals(const FindingsContext& context, const Model& model,
                                   Diagnosis& diagnosis) {
  const Pool& pool = context.pool;
  const Dataset& data = context.problem.data;
  const std::vector<EffectKey> keys = EffectKeys(pool, context.best);
  std::vector<Explanation> told;
  std::set<std::pair<EffectKey, EffectKey>> named;
  std::set<std::pair<std::vector<EffectKey>, std::vector<EffectKey>>> refitted, left;
  const Result<Linearisation> own = Linearise(data, model, false, context.options.threads);
  const auto cost = [](const Explanation& explanation) {
    return explanation.score - explanation.chi2;
  };
  for (const Explanation& other : context.ranked) {
    if (other.score > context.best.score + kWorthRefitting) break;
    const std::vector<EffectKey> other_keys = EffectKeys(pool, other);
    if (other.blocks.empty() || other_keys.size() > keys.size()) continue;
    std::vector<EffectKey> lacking, instead;
    std::set_difference(keys.begin(), keys.end(), other_keys.begin(), other_keys.end(),
                        std::back_inserter(lacking));
    std::set_difference(other_keys.begin(), other_keys.end(), keys.begin(), keys.end(),
                        std::back_inserter(instead));
    if (lacking.empty() || instead.empty() || refitted.contains({lacking, instead})) continue;
    if (refitted.size() >= kMostRefits) {
      left.emplace(lacking, instead);
      continue;
    }
    Model start = model;
    start.effects = EffectsFrom(data, pool.blocks(), pool.CoefficientsOf(other));
    const Result<Refit> refit = RefitModel(context.problem, start, {});
    if (!refit) continue;
    refitted.emplace(lacking, instead);
    const double gap = refit->chi2 + cost(other) - (context.refit.chi2 + cost(context.best));
    if (gap > kRivalGap) continue;
    const Result<Linearisation> theirs =
        Linearise(data, refit->model, false, context.options.threads);
    for (const EffectKey& lacks : lacking) {
      for (const EffectKey& key : instead) {
        if (!named.emplace(lacks, key).second) continue;
        Rival& rival = diagnosis.rivals.emplace_back();
        rival.instead_of = lacks.id;
        rival.instead_of_word = lacks.word;
        rival.id = key.id;
        rival.word = key.word;
        for (const ActiveEffect& effect : refit->model.effects) {
          if (effect.term.effect->traits().id == key.id && effect.term.word == key.word)
            rival.scope = ScopeOf(effect.term);
        }
        rival.signal_left = pool.SignalLeft(context.best, lacks, other.blocks);
        rival.evidence_gap = gap;
        for (const RowIndex row : data.row_indices()) {
          if (!own || !theirs) break;
          rival.shift_W.emplace_back(theirs->rows[row].p_W - own->rows[row].p_W);
        }
      }
    }
    told.push_back(other);
    told.back().score = context.best.score + gap;
  }
  if (!left.empty()) {
    diagnosis.notes.push_back(fmt::format(
        "{} possible rivals were refitted; {} more came near enough to be worth it and were not",
        kMostRefits, left.size()));
  }
  return told;
}

void AddConsidered(const FindingsContext& context, const Candidates& candidates,
                   Diagnosis& diagnosis) {
  const Pool& pool = context.pool;
  std::map<std::string, double> best_with;
  for (const Explanation& explanation : context.ranked) {
    for (const std::string& id : EffectIds(pool, explanation)) {
      const auto [entry, fresh] = best_with.emplace(id, explanation.score);
      if (!fresh) entry->second = std::min(entry->second, explanation.score);
    }
  }
  const std::vector<std::string> taken = EffectIds(pool, context.best);
  std::map<std::string, Considered> by_id;
  for (const BlockIndex index : pool.blocks().indices()) {
    const Block& block = pool.blocks()[index];
    if (block.empirical()) continue;
    Considered considered;
    considered.id = block.id;
    if (!pool.Observable(index)) {
      considered.reason = "the frames, or joints that never moved, hide all of it in these rows";
    } else {
      const Explanation alone = pool.Evaluate({index});
      considered.parameters = static_cast<int>(alone.columns.size());
      considered.chi2_drop = pool.chi2_null() - alone.chi2;
      considered.signal_share = considered.chi2_drop / std::max(1e-12, pool.chi2_null());
      for (const ActiveEffect& effect :
           EffectsFrom(context.problem.data, pool.blocks(), pool.CoefficientsOf(alone))) {
        considered.scope = ScopeOf(effect.term);
      }
    }
    const auto known = by_id.find(block.id);
    if (known == by_id.end() || known->second.chi2_drop < considered.chi2_drop) {
      by_id[block.id] = considered;
    }
  }
  for (auto& [id, considered] : by_id) {
    considered.taken = std::find(taken.begin(), taken.end(), id) != taken.end();
    const auto score = best_with.find(id);
    if (score != best_with.end()) {
      considered.evidence_gap = score->second - context.best.score;
    } else if (considered.reason.empty() && context.ranked.size() >= kMostListed) {
      considered.evidence_gap = context.ranked.back().score - context.best.score;
      considered.beyond_gap = true;
    }
    const bool rival = std::any_of(diagnosis.rivals.begin(), diagnosis.rivals.end(),
                                   [&id = id](const Rival& r) { return r.id == id; });
    if (considered.taken) {
      considered.reason = "taken";
    } else if (rival) {
      considered.reason = "a rival: these rows cannot tell";
    } else if (considered.reason.empty()) {
      considered.reason =
          considered.parameters == 0
              ? "brings nothing beyond the noise"
              : fmt::format(
                    "explains {:.0f} % alone, but not what remains beside a better explanation",
                    100 * considered.signal_share);
    }
    diagnosis.considered.push_back(considered);
  }
  for (const NotOffered& missing : candidates.not_offered) {
    Considered& considered = diagnosis.considered.emplace_back();
    considered.id = missing.id;
    considered.reason = missing.reason;
  }
  std::stable_sort(diagnosis.considered.begin(), diagnosis.considered.end(),
                   [](const Considered& a, const Considered& b) {
                     return a.taken != b.taken ? a.taken : a.chi2_drop > b.chi2_drop;
                   });
}

namespace {

/// The distinct loads of the rows, ascending; none where three or more are apart by a tenth of
/// their range, so that their rows can show a deflection that is not in proportion to the load.
std::vector<double> FewPayloadLevels(const FitProblem& problem) {
  constexpr double kApart = 0.1;
  std::vector<double> loads_kg, levels_kg;
  for (const RowIndex row : problem.data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight) continue;
    loads_kg.push_back(problem.data.measured(row).payload_kg);
  }
  std::sort(loads_kg.begin(), loads_kg.end());
  if (!problem.data.table.recorded.payload || loads_kg.empty()) return {};
  const double range_kg = loads_kg.back() - loads_kg.front();
  for (const double load_kg : loads_kg) {
    if (levels_kg.empty() || load_kg - levels_kg.back() >= std::max(kApart * range_kg, 1e-9)) {
      levels_kg.push_back(load_kg);
    }
  }
  return levels_kg.size() == 2 ? std::vector<double>{loads_kg.front(), loads_kg.back()}
                               : std::vector<double>{};
}

}  // namespace

void AddFramesAndDomain(const FitProblem& problem, const Model& model, Diagnosis& diagnosis) {
  const Dataset& data = problem.data;
  if (data.frames_free() || data.tip_free()) {
    for (const SessionIndex session : data.sessions.indices()) {
      SessionFrames frames;
      frames.id = data.sessions[session].empty() ? "1" : data.sessions[session];
      frames.X_WB = model.frames[session].X_WB;
      if (data.tip_free()) frames.tip_F = model.frames[session].tip_F;
      diagnosis.sessions.push_back(frames);
    }
  }
  Domain& domain = diagnosis.domain;
  const auto widen = [](Interval& interval, double value) {
    interval.low = std::min(interval.low, value);
    interval.high = std::max(interval.high, value);
  };
  for (const RowIndex index : data.row_indices()) {
    if (problem.weights[index] < kOutlierWeight) continue;
    const MeasuredRow& row = data.measured(index);
    if (domain.q.empty()) {
      for (const double q : row.q) domain.q.push_back({q, q});
      if (data.table.recorded.payload) domain.payload_kg = Interval{row.payload_kg, row.payload_kg};
      if (data.table.recorded.temperature) domain.temp_C = Interval{row.temp_C, row.temp_C};
    }
    for (std::size_t i = 0; i < domain.q.size(); ++i)
      widen(domain.q[i], row.q[static_cast<int>(i)]);
    if (domain.payload_kg) widen(*domain.payload_kg, row.payload_kg);
    if (domain.temp_C) widen(*domain.temp_C, row.temp_C);
  }
  domain.payload_levels_kg = FewPayloadLevels(problem);
}

}  // namespace plumbline
