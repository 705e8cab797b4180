// Conversion of the discrepancy model to effects of a cell file.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/measure/diagnosis/search/discrepancy.h"
#include "app/measure/diagnosis/search/findings.h"
#include "firmware-like/effects/empirical.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;

/// Value of the same parameter in a model; 0 if no effect has it.
double NamedValue(const Model& named, const effects::EffectTerm& term,
                  const effects::TermParameter& parameter) {
  double sum = 0;
  for (const effects::ActiveEffect& effect : named.effects) {
    if (effect.term.effect != term.effect || effect.term.word != term.word) continue;
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      if (effect.term.parameters[k] == parameter) sum += effect.values[k];
    }
  }
  return sum;
}

bool IsNamed(const Model& named, const effects::EffectTerm& term) {
  return std::ranges::any_of(named.effects, [&](const effects::ActiveEffect& effect) {
    return effect.term.effect == term.effect && effect.term.word == term.word;
  });
}

/// Rotation [rad] of a joint at angle q by named periodic lines and curves along that angle.
double NamedTurn(const Model& named, int joint, double q) {
  double turn = 0;
  for (const effects::ActiveEffect& effect : named.effects) {
    const bool lines = RepeatsWithAngle(*effect.term.effect);
    const bool curve = effect.term.drivers == std::vector<std::string>{AngleColumn(joint)} &&
                       effect.term.parameters.size() == 1 &&
                       effect.term.parameters.front().joint == joint;
    if (!lines && !curve) continue;
    effects::Conditions moment;
    moment.q = model::JointVector::Zero(joint + 1);
    moment.q[joint] = q;
    effects::EffectTerm term = effect.term;
    std::vector<double> values;
    term.parameters.clear();
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      if (effect.term.parameters[k].joint != joint) continue;
      term.parameters.push_back(effect.term.parameters[k]);
      values.push_back(effect.values[k]);
    }
    I influence;
    term.effect->Add(term, std::span<const double>(values), moment, influence);
    turn += influence.Joint(I::kTurn, joint);
  }
  return turn;
}

std::string NameOf(int entry) {
  if (entry < model::kMaxJoints) return "q" + std::to_string(entry + 1);
  return std::string("base_") + "xyz"[entry - I::kBase];
}

/// The curve of one carrier along one signal as an `empirical` effect; nullopt if it is smaller
/// than the resolution of the file format.
std::optional<Finding> CurveOf(const DiscrepancyModel& discrepancy, const Dataset& data,
                               const std::vector<std::size_t>& terms, const Model& named) {
  const CurveTerm& any = discrepancy.curves[terms.front()];
  const RecordedSignal& signal = data.signals[any.signal];
  double cycles = 0;
  for (const std::size_t term : terms) cycles = std::max(cycles, discrepancy.curves[term].cycles);
  // A joint curve continues beyond the rows as fitted, so that components shared with offsets and
  // frames still cancel there.
  constexpr double kBeyond = 0.25;  // of the range, on each side
  constexpr int kMinNodes = 33, kNodesPerWave = 8;
  constexpr double kLeast = 1e-8;  // rad or m
  const double beyond = signal.of_joint ? kBeyond * (signal.high - signal.low) : 0;
  const model::Interval range{signal.low - beyond, signal.high + beyond};
  const int nodes = std::max(
      kMinNodes, static_cast<int>(kNodesPerWave * cycles * (range.high - range.low) / 360));
  const auto size = static_cast<Eigen::Index>(terms.size());
  Eigen::VectorXd values(size);
  std::vector<Eigen::Index> places;  // indices into the covariance
  for (std::size_t k = 0; k < terms.size(); ++k) {
    values[static_cast<Eigen::Index>(k)] = discrepancy.curves[terms[k]].value;
    places.push_back(static_cast<Eigen::Index>(discrepancy.size_columns.size() + terms[k]));
  }
  const Eigen::MatrixXd covariance = discrepancy.covariance(places, places);
  model::WrittenEffect written;
  written.id = effects::Empirical().traits().id;
  written.drivers = {signal.column};
  written.nodes.setZero(nodes, 2);
  double largest = 0, square = 0, variance = 0;
  for (int node = 0; node < nodes; ++node) {
    const double u = range.low + (range.high - range.low) * node / (nodes - 1);
    Eigen::VectorXd factors(size);
    for (std::size_t k = 0; k < terms.size(); ++k) {
      factors[static_cast<Eigen::Index>(k)] = FactorAt(data, discrepancy.curves[terms[k]], u);
    }
    double curve = factors.dot(values);
    if (signal.of_joint) curve -= NamedTurn(named, any.entry, u * std::numbers::pi / 180);
    written.nodes(node, 0) = u;
    written.nodes(node, 1) = (any.entry < model::kMaxJoints ? 1.0 : 1e3) * curve;
    if (u < signal.low || u > signal.high) continue;
    largest = std::max(largest, std::abs(curve));
    square += curve * curve;
    variance += factors.dot(covariance * factors);
  }
  if (largest < kLeast) return std::nullopt;
  model::EffectParameter& parameter = written.parameters.emplace_back();
  parameter.name = NameOf(any.entry);
  parameter.value = 1;
  parameter.unit = "1";
  Finding finding;
  finding.effect = effects::ActiveFromWritten(written, data.cell);
  finding.covariance = Eigen::MatrixXd::Constant(1, 1, variance / square);
  if (!HasUsableCovariance(finding)) finding.covariance.resize(0, 0);
  return finding;
}

}  // namespace

std::vector<Finding> EffectsToAdd(const DiscrepancyModel& discrepancy, const Dataset& data,
                                  const Model& named) {
  std::vector<Finding> added;
  Eigen::Index at = 0;
  for (const BlockIndex b : discrepancy.blocks.indices()) {
    const Block& block = discrepancy.blocks[b];
    Finding finding;
    finding.effect.term = block.term;
    finding.effect.term.parameters.clear();
    const auto width = static_cast<Eigen::Index>(block.columns.size());
    for (const BlockColumnIndex c : block.columns.indices()) {
      const effects::TermParameter& parameter = block.term.parameters[block.columns[c].parameter];
      finding.effect.term.parameters.push_back(parameter);
      finding.effect.values.push_back(discrepancy.sizes.at({b, c}) -
                                      NamedValue(named, block.term, parameter));
    }
    // A named effect has its own deviations; the others get those of the posterior.
    if (!IsNamed(named, block.term)) {
      finding.covariance = discrepancy.covariance.block(at, at, width, width);
    }
    at += width;
    const bool nothing =
        std::ranges::all_of(finding.effect.values, [](double value) { return value == 0; });
    if (!HasUsableCovariance(finding)) finding.covariance.resize(0, 0);
    if (!nothing) added.push_back(std::move(finding));
  }
  std::map<std::pair<SignalIndex, int>, std::vector<std::size_t>> curves;  // by signal and carrier
  for (std::size_t k = 0; k < discrepancy.curves.size(); ++k) {
    curves[{discrepancy.curves[k].signal, discrepancy.curves[k].entry}].push_back(k);
  }
  for (const auto& [key, terms] : curves) {
    if (auto curve = CurveOf(discrepancy, data, terms, named)) added.push_back(std::move(*curve));
  }
  return added;
}

}  // namespace plumbline::measure
