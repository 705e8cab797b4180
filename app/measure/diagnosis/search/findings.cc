#include "app/measure/diagnosis/search/findings.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/plausibility.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "firmware-like/effects/empirical.h"
#include "firmware-like/effects/parameter_name.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

/// Values and displacements of one carrier's curve at the accepted rows, SI.
struct CurveAtRows {
  struct Lever {
    double payload_kg = 0;
    double square = 0;  ///< |J|^2
  };
  double low = 1e300, high = -1e300;  ///< range of the curve
  double largest_m = 0;               ///< largest displacement of the tip
  std::vector<Lever> levers;          ///< of each row
};

CurveAtRows EvaluateAtRows(const FitProblem& problem, const Linearisation& linear,
                           const effects::ActiveEffect& effect, std::size_t carrier) {
  std::vector<double> values(effect.values.size(), 0.0);
  values[carrier] = 1;
  CurveAtRows seen;
  for (const RowIndex row : linear.rows.indices()) {
    if (problem.weights[row] < kOutlierWeight) continue;
    const effects::Conditions& moment = problem.data.conditions[row];
    effects::Influence<double> influence;
    effect.term.effect->Add(effect.term, std::span<const double>(values), moment, influence);
    for (int entry = 0; entry < effects::Influence<double>::kSize; ++entry) {
      if (influence[entry] == 0) continue;
      const double lever = LengthsOf(linear.gradients[row].col(entry)).norm();
      seen.low = std::min(seen.low, influence[entry]);
      seen.high = std::max(seen.high, influence[entry]);
      seen.largest_m = std::max(seen.largest_m, std::abs(influence[entry]) * lever);
      seen.levers.push_back({moment.payload_kg, lever * lever});
    }
  }
  return seen;
}

/// RMS lever arm of the rows with payloads from `low` to `high` [kg]; 0 if there are none.
double LeverBetween(const CurveAtRows& seen, double low, double high) {
  double sum = 0, count = 0;
  for (const CurveAtRows::Lever& lever : seen.levers) {
    if (lever.payload_kg < low || lever.payload_kg > high) continue;
    sum += lever.square;
    count += 1;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

/// RMS lever arm by which a node moves the tip: over all rows, since any pose may occur at the
/// node's value; if the payload is a driver, over the rows with payloads near the node's.
double LeverOfNode(const CurveAtRows& seen, const effects::ActiveEffect& effect,
                   Eigen::Index node) {
  constexpr std::string_view kPayloadColumn = "payload_kg";
  const double of_all = LeverBetween(seen, -HUGE_VAL, HUGE_VAL);
  const auto& drivers = effect.term.drivers;
  const auto payload = std::ranges::find(drivers, kPayloadColumn);
  if (payload == drivers.end()) return of_all;
  const auto loads_kg = effect.term.nodes.col(payload - drivers.begin());
  double low = -HUGE_VAL, high = HUGE_VAL;  // of the neighbours
  for (const double load_kg : loads_kg) {
    if (load_kg < loads_kg[node]) low = std::max(low, load_kg);
    if (load_kg > loads_kg[node]) high = std::min(high, load_kg);
  }
  const double near_node = LeverBetween(seen, low, high);
  return near_node > 0 ? near_node : of_all;
}

}  // namespace

void BoundToRows(const FitProblem& problem, const Linearisation& linear,
                 effects::ActiveEffect& effect) {
  if (effect.term.nodes.rows() == 0) return;
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const CurveAtRows seen = EvaluateAtRows(problem, linear, effect, k);
    auto nodes = effect.term.nodes.col(static_cast<Eigen::Index>(k + effect.term.drivers.size()));
    if (seen.largest_m == 0) {
      nodes.setZero();
      continue;
    }
    const double to_SI = effects::EmpiricalNodeToSI(effect.term.parameters[k]);
    for (Eigen::Index node = 0; node < nodes.size(); ++node) {
      const double largest = seen.largest_m / LeverOfNode(seen, effect, node);
      const double low = std::max(seen.low, -largest), high = std::min(seen.high, largest);
      nodes[node] = std::clamp(nodes[node], low / to_SI, std::max(low, high) / to_SI);
    }
  }
}

namespace {

constexpr int kMostRows = 500;

bool IsSize(const effects::EffectTerm& term, std::size_t value) {
  const auto spec = static_cast<std::size_t>(term.parameters[value].spec);
  return term.effect->traits().parameters[spec].role == effects::ParameterRole::kSize;
}

}  // namespace

TipDisplacement TipDisplacementOf(const FitProblem& problem, const effects::ActiveEffect& effect) {
  const Dataset& data = problem.data;
  const deflection::LoadedArm arm(data.cell);
  const std::size_t values = effect.values.size();
  std::vector<effects::ActiveEffect> alone(values, effect);
  for (std::size_t k = 0; k < values; ++k) {
    for (std::size_t other = 0; other < values; ++other) {
      if (other != k && IsSize(effect.term, other)) alone[k].values[other] = 0;
    }
  }
  double all = 0;
  std::vector<double> each(values, 0.0);
  int used = 0;
  deflection::LoadedState state;
  for (const RowIndex row : EvenlySpacedRows(data, kMostRows)) {
    if (problem.weights[row] < kOutlierWeight) continue;
    const effects::Conditions& moment = data.conditions[row];
    const effects::Influence<double> declared = arm.EffectsAt(moment, data.payloads[row]);
    const auto at = [&](const effects::ActiveEffect* added) -> std::optional<Vec3> {
      effects::Influence<double> influence = declared;
      if (added != nullptr) effects::AddEffects({added, 1}, moment, influence);
      if (!arm.AtCommanded(data.measured(row).q, data.payloads[row], &influence, moment.tau, state))
        return std::nullopt;
      return state.p_read_W;
    };
    const auto without = at(nullptr), with = at(&effect);
    if (!without || !with) continue;
    ++used;
    all += (*with - *without).squaredNorm();
    for (std::size_t k = 0; k < values; ++k) {
      if (!IsSize(effect.term, k)) continue;
      const auto by_it = values == 1 ? with : at(&alone[k]);
      if (by_it) each[k] += (*by_it - *without).squaredNorm();
    }
  }
  TipDisplacement displacement{0, std::vector<double>(values, 0.0)};
  if (used == 0) return displacement;
  displacement.all_m = std::sqrt(all / used);
  for (std::size_t k = 0; k < values; ++k) displacement.each_m[k] = std::sqrt(each[k] / used);
  return displacement;
}

namespace {

/// Number of shapes and choices of joints among which the blocks of an effect were selected.
double Trials(const CandidateSet& candidate_set, const Explanation& explanation,
              const std::vector<BlockIndex>& blocks) {
  double trials = 1;
  for (const BlockIndex block : blocks) {
    const Block& own = candidate_set.blocks()[block];
    trials *= std::max(1.0, own.trials) * std::exp(LogChoices(candidate_set, explanation, block));
  }
  return trials;
}

/// Index of each value of an effect among the refitted parameters; -1: not adjusted.
std::vector<int> PlacesOf(const Refit& refit, std::size_t effect) {
  std::vector<int> places(refit.model.effects[effect].values.size(), -1);
  for (std::size_t j = 0; j < refit.parameters.size(); ++j) {
    const auto [own_effect, value] = refit.parameters[j];
    if (own_effect == static_cast<int>(effect)) {
      places[value] = static_cast<int>(j);
    }
  }
  return places;
}

Eigen::MatrixXd CovarianceAt(const Eigen::MatrixXd& covariance, const std::vector<int>& places,
                             double inflation) {
  const auto size = static_cast<int>(places.size());
  Eigen::MatrixXd at = Eigen::MatrixXd::Zero(size, size);
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) {
      const int a = places[i], b = places[j];
      if (a >= 0 && b >= 0) at(i, j) = inflation * covariance(a, b);
    }
  }
  return at;
}

/// Effect of removing an effect while all others keep their joints.
struct Removal {
  double chi2 = 0;       ///< increase
  double columns = 0;    ///< removed, at least 1
  double trials = 1;     ///< effects, shapes and choices of joints searched
  double inflation = 1;  ///< of the variance by row-to-row correlation, as CandidateSet::Inflation
};

Removal RemovalOf(const FindingsContext& context, const EffectKey& key) {
  const CandidateSet& candidate_set = context.candidate_set;
  std::vector<ColumnIndex> others;
  for (const ColumnIndex column : context.best.columns) {
    if (KeyOf(candidate_set.blocks()[candidate_set.BlockOfColumn(column)]) != key)
      others.push_back(column);
  }
  const Explanation without = candidate_set.FitColumns(others);
  const std::vector<BlockIndex> blocks = BlocksOfEffect(candidate_set, context.best, key);
  double inflation = 1;
  for (const BlockIndex block : blocks)
    inflation = std::max(inflation, candidate_set.Inflation(block));
  return {std::max(0.0, without.chi2 - context.best.chi2),
          std::max<double>(1, static_cast<double>(context.best.columns.size()) -
                                  static_cast<double>(without.columns.size())),
          EffectsConsidered(context.problem.data) * Trials(candidate_set, context.best, blocks),
          inflation};
}

/// Columns of one effect without what the other effects of the explanation explain of them,
/// orthonormal, shape (residuals, columns).
Eigen::MatrixXd OwnDirections(const FindingsContext& context, const EffectKey& key) {
  const CandidateSet& candidate_set = context.candidate_set;
  const Eigen::MatrixXd& all = candidate_set.columns();
  std::vector<int> own, others;
  for (const ColumnIndex column : context.best.columns) {
    const bool of_effect =
        KeyOf(candidate_set.blocks()[candidate_set.BlockOfColumn(column)]) == key;
    (of_effect ? own : others).push_back(column.value());
  }
  Eigen::MatrixXd directions = all(Eigen::all, own);
  if (!others.empty()) {
    const Eigen::MatrixXd beside = all(Eigen::all, others);
    directions -= beside * beside.colPivHouseholderQr().solve(directions);
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(directions);
  return qr.householderQ() * Eigen::MatrixXd::Identity(directions.rows(), qr.rank());
}

/// Variance of the residual in the directions of an effect, as a multiple of the noise's and at
/// least 1: with c the clusters and q_c the part of an orthonormal column,
///   n / (n - p) mean over the columns of sum_c (q_c . r_c)^2
/// [cluster-robust variance; H. White, Econometrica 48 (1980) 817]. A cause that is not among the
/// candidates and acts along one joint makes the noise there larger, and imitates effects of that
/// joint.
double VarianceAlong(const FindingsContext& context, const EffectKey& key) {
  const LinearProblem& problem = context.candidate_set.problem();
  const Eigen::MatrixXd directions = OwnDirections(context, key);
  if (directions.cols() == 0) return 1;
  const Eigen::VectorXd residual = context.candidate_set.Residual(context.best);
  std::map<ClusterIndex, Eigen::VectorXd> sums;
  for (const FitRowIndex row : problem.rows().indices()) {
    const auto [sum, added] = sums.try_emplace(problem.data().cluster_of[problem.rows()[row]],
                                               Eigen::VectorXd::Zero(directions.cols()));
    sum->second += problem.layout().PartOf(directions, row).transpose() *
                   problem.layout().PartOf(residual, row);
  }
  double square = 0;
  for (const auto& [cluster, sum] : sums) square += sum.squaredNorm();
  const double freedom = problem.freedom();
  const double left = std::max(1.0, freedom - static_cast<double>(context.best.columns.size()));
  return std::max(1.0, freedom / left * square / static_cast<double>(directions.cols()));
}

/// Time span of the rows that were not rejected [s].
model::Interval TimesSeen(const FitProblem& problem) {
  model::Interval seen{1e300, -1e300};
  for (const RowIndex row : problem.data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight) continue;
    const double t_s = *problem.data.measured(row).t_s;
    seen.low = std::min(seen.low, t_s);
    seen.high = std::max(seen.high, t_s);
  }
  return seen;
}

/// Shrinks an empirical effect and limits it to the values at its rows.
void ShrinkToRows(const FindingsContext& context, const Removal& removal, Finding& finding) {
  // James-Stein factor: shrinks a curve fitted to noise alone to about zero.
  const double factor =
      std::max(0.0, 1 - std::max(0.0, removal.columns - 2) / std::max(removal.chi2, 1e-9));
  for (double& value : finding.effect.values) value *= factor;
  BoundToRows(context.problem, context.candidate_set.problem().linear(), finding.effect);
  const double sd = 1 / std::sqrt(std::max(removal.chi2, 1.0));
  const Eigen::Index size = finding.covariance.rows();
  finding.covariance = Eigen::MatrixXd::Identity(size, size) * sd * sd;
}

/// The time or row of an event is known to lie between two rows only: sets its variance to that of
/// a uniform distribution over the gap.
void SetEventTimeVariance(const Dataset& data, Finding& finding) {
  const effects::EffectTerm& term = finding.effect.term;
  const bool by_row = term.effect->traits().parameters[term.parameters.front().spec].name == "row";
  std::vector<double> times;
  for (const effects::Conditions& moment : data.conditions)
    times.push_back((by_row ? moment.row : moment.t_s).value_or(0));
  std::ranges::sort(times);
  const auto next = std::upper_bound(times.begin(), times.end(), finding.effect.values.front());
  if (next == times.begin() || next == times.end()) return;
  const double gap = *next - *(next - 1);
  finding.covariance(0, 0) = gap * gap / 12;
}

/// @param inflation  factor on the formal covariance: chi2 per degree of freedom, at least 1
Finding FindingOf(const FindingsContext& context, std::size_t effect, double inflation) {
  const Dataset& data = context.problem.data;
  Finding finding;
  finding.effect = context.refit.model.effects[effect];
  const effects::EffectTerm& term = finding.effect.term;
  const std::vector<int> places = PlacesOf(context.refit, effect);
  const EffectKey key{std::string(term.effect->traits().id), std::string(term.word)};
  const Removal removal = RemovalOf(context, key);
  inflation *= removal.inflation;
  finding.covariance = CovarianceAt(context.refit.covariance, places, inflation);
  const double variance = std::max(inflation, VarianceAlong(context, key));
  finding.p_value = std::min(
      1.0, removal.trials * statistics::ChiSquareTail(removal.chi2 / variance, removal.columns));
  finding.share_of_residual = removal.chi2 / std::max(1e-12, context.candidate_set.chi2_null());
  const Implausible implausible = ImplausibilityOf(data, finding.effect);
  finding.implausible = implausible.sentence;
  finding.implausible_times = implausible.times;
  if (effects::FollowsTime(term) && data.table.recorded.time) {
    finding.effect.seen_t_s = TimesSeen(context.problem);
  }
  if (term.effect->traits().empirical) {
    ShrinkToRows(context, removal, finding);
  } else if (ActsFromEventTime(term)) {
    SetEventTimeVariance(data, finding);
  }
  TipDisplacement displacement = TipDisplacementOf(context.problem, finding.effect);
  finding.tip_rms_m = displacement.all_m;
  finding.tip_rms_of_each_m = std::move(displacement.each_m);
  const bool identifiable = std::ranges::all_of(
      places, [&](int place) { return place < 0 || context.refit.identifiable[place]; });
  if (!identifiable || !HasUsableCovariance(finding)) finding.covariance.resize(0, 0);
  return finding;
}

/// Effect id and parameter name of each refitted parameter.
std::vector<std::string> ParameterNames(const Refit& refit) {
  std::vector<std::string> names;
  for (const auto& [effect, value] : refit.parameters) {
    const effects::EffectTerm& term = refit.model.effects[effect].term;
    const effects::EffectTraits& traits = term.effect->traits();
    names.push_back(fmt::format("{} {}", traits.id,
                                effects::NameFromParameter(traits, term.parameters[value])));
  }
  return names;
}

Eigen::MatrixXd CorrelationOf(const Eigen::MatrixXd& covariance, std::size_t parameters) {
  const auto count = static_cast<int>(parameters);
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) {
      const double scale = std::sqrt(covariance(i, i) * covariance(j, j));
      if (i != j && scale > 0) correlation(i, j) = covariance(i, j) / scale;
    }
  }
  return correlation;
}

}  // namespace

bool HasUsableCovariance(const Finding& finding) {
  constexpr double kLargestVariance = 1e11;  // in file units
  const model::WrittenEffect written =
      effects::WrittenFromActive(finding.effect, finding.covariance);
  return written.covariance.allFinite() &&
         (written.covariance.size() == 0 ||
          written.covariance.cwiseAbs().maxCoeff() < kLargestVariance);
}

EffectKey KeyOfFinding(const Finding& finding) {
  return {std::string(finding.effect.term.effect->traits().id),
          std::string(finding.effect.term.word)};
}

void AddFindings(const FindingsContext& context, Diagnosis& diagnosis) {
  const double freedom = std::max(1.0, context.candidate_set.problem().freedom() -
                                           static_cast<double>(context.best.columns.size()));
  // A residual above the noise makes the formal covariance too small.
  const double inflation = std::max(1.0, context.best.chi2 / freedom);
  for (std::size_t effect = 0; effect < context.refit.model.effects.size(); ++effect) {
    diagnosis.findings.push_back(FindingOf(context, effect, inflation));
  }
  diagnosis.finding_names = ParameterNames(context.refit);
  diagnosis.correlation = CorrelationOf(context.refit.covariance, context.refit.parameters.size());
}

}  // namespace plumbline::measure
