#include "tests/app/measure/diagnosis/example_diagnosis.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::test {
namespace {

constexpr int kRows = 96;
constexpr double kSigma = 0.05e-3;

struct Parameter {
  const char* name;
  double value_SI;
  double sd_SI;
};

/// A finding with independent parameters.
measure::Finding MakeFinding(const char* id, const std::vector<Parameter>& parameters,
                             double share) {
  measure::Finding finding;
  finding.effect.term.effect = effects::FindEffect(id);
  finding.covariance = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(parameters.size()),
                                             static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    finding.effect.term.parameters.push_back(*effects::ParameterFromName(
        finding.effect.term.effect->traits(), parameters[k].name, model::kMaxJoints));
    finding.effect.values.push_back(parameters[k].value_SI);
    const auto i = static_cast<Eigen::Index>(k);
    finding.covariance(i, i) = parameters[k].sd_SI * parameters[k].sd_SI;
  }
  if (parameters.size() == 2) {
    finding.covariance(0, 1) = finding.covariance(1, 0) =
        0.31 * parameters[0].sd_SI * parameters[1].sd_SI;
  }
  finding.p_value = 1e-6;
  finding.share_of_residual = share;
  return finding;
}

/// A measurement of the example cell, row by row, and the tips predicted by the models.
class Simulation {
 public:
  Simulation() : random_(7) {
    model::CellModel cell = ExampleCell();
    for (int k = 0; k < kRows; ++k) {
      effects::Conditions moment;
      moment.q = RandomPosture(cell, random_);
      moment.payload_kg = 20.0 * std::uniform_int_distribution(0, 4)(random_);
      moment.t_s = 20.0 * k + (k < kRows / 2 ? 0 : 7200);
      moment.temp_C = 22 + 9 * (1 - std::exp(-*moment.t_s / 4000));
      moment.row = k + 1;
      moment.reference_temperature_C = 22;
      moments.push_back(moment);
      pressure_bar.push_back(6 + 0.5 * std::sin(0.13 * k) + 0.1 * Normal());
    }
  }

  double Normal() { return std::normal_distribution<double>()(random_); }
  Vec3 Noise() { return kSigma * Vec3(Normal(), Normal(), Normal()); }

  std::vector<Vec3> Tips(const std::vector<measure::Finding>& findings) const {
    model::CellModel cell = ExampleCell();
    for (const measure::Finding& finding : findings) {
      cell.effects.push_back(effects::WrittenFromActive(finding.effect, finding.covariance));
    }
    const deflection::LoadedArm arm(cell);
    const auto robot = std::make_shared<const model::Robot>(cell.robot);
    std::vector<Vec3> tips;
    for (effects::Conditions moment : moments) {
      deflection::LoadedState state;
      moment.robot = robot;
      const loads::Payload payload{moment.payload_kg, *cell.payload_cog_F};
      if (!arm.AtCommanded(moment.q, payload, moment, state)) std::abort();
      tips.push_back(state.X_WT.p);
    }
    return tips;
  }

  std::vector<effects::Conditions> moments;
  std::vector<double> pressure_bar;

 private:
  std::mt19937 random_;
};

void AddSignals(const Simulation& simulation, measure::Verdict verdict,
                measure::Diagnosis& diagnosis) {
  measure::PerRow<double> t, temp, payload;
  for (const effects::Conditions& moment : simulation.moments) {
    t.push_back(*moment.t_s);
    temp.push_back(*moment.temp_C);
    payload.push_back(moment.payload_kg);
  }
  const bool unknown = verdict == measure::Verdict::kUnknown;
  diagnosis.signals.push_back({"t_s", t, 0.31, 0.02});
  for (int joint = 0; joint < 6; ++joint) {
    measure::PerRow<double> values;
    for (const effects::Conditions& moment : simulation.moments) {
      values.emplace_back(moment.q[joint] / kDegree);
    }
    const std::string name = "q" + std::to_string(joint + 1) + "_deg";
    diagnosis.signals.push_back({name, values, 0.2 + 0.1 * joint, 0.01});
  }
  diagnosis.signals.push_back({"payload_kg", payload, 0.44, 0.01});
  diagnosis.signals.push_back({"temp_C", temp, 0.52, 0.01});
  diagnosis.signals.push_back({"air_pressure_bar", measure::PerRow<double>(simulation.pressure_bar),
                               unknown ? 1e-4 : 0.7, unknown ? 0.78 : 0.005});
}

void AddRows(Simulation& simulation, const std::vector<measure::Finding>& truth,
             measure::Verdict verdict, measure::Diagnosis& diagnosis) {
  const std::vector<Vec3> declared = simulation.Tips({}), real = simulation.Tips(truth);
  double before = 0, after = 0;
  for (std::size_t k = 0; k < declared.size(); ++k) {
    measure::RowTrace row;
    row.line = static_cast<int>(k) + 2;
    row.session = k < kRows / 2 ? "1" : "2";
    row.fold = static_cast<int>(k) / 12;
    row.after = simulation.Noise();
    if (verdict == measure::Verdict::kUnknown) {
      row.after.z() += 0.9e-3 * (simulation.pressure_bar[k] - 6);
    }
    if (k == 15 || k == 52) {
      row.weight = 0;
      row.outlier = true;
      row.after += Vec3(0.9e-3, -0.4e-3, 0.3e-3);
    }
    row.before = real[k] - declared[k] + row.after;
    row.p_measured = declared[k] + row.before;
    row.held_out_before = 1.01 * row.before;
    row.held_out_after = 1.05 * row.after;
    if (row.weight > 0) {
      before += row.before.squaredNorm();
      after += row.after.squaredNorm();
    }
    diagnosis.rows.push_back(row);
  }
  diagnosis.outlier_rows = {17, 54};
  diagnosis.rms_before_m = std::sqrt(before / (kRows - 2));
  diagnosis.rms_after_m = std::sqrt(after / (kRows - 2));
  diagnosis.held_out = {"blocks of time", 1.01 * diagnosis.rms_before_m,
                        1.05 * diagnosis.rms_after_m, 0.98 * diagnosis.rms_after_m,
                        1.12 * diagnosis.rms_after_m};
}

void AddSpectrum(Simulation& simulation, measure::Diagnosis& diagnosis) {
  for (int joint = 0; joint < 6; ++joint) {
    for (int step = 1; step <= 120; ++step) {
      const double cycles = 0.5 * step;
      diagnosis.spectrum.push_back({joint, cycles, 2e-6 * std::abs(simulation.Normal())});
    }
  }
}

void AddCandidateOutcomes(measure::Diagnosis& diagnosis) {
  const auto taken = [&](std::string_view id) {
    return std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                       [id](const measure::Finding& finding) {
                         return finding.effect.term.effect->traits().id == id;
                       });
  };
  double gap = -12;
  for (const effects::Effect* effect : effects::Catalogue()) {
    measure::CandidateOutcome considered;
    considered.id = effect->traits().id;
    considered.parameters = static_cast<int>(effect->traits().parameters.size());
    if (effect->traits().per_joint) considered.scope = {"q2"};
    considered.taken = taken(considered.id);
    considered.reason = considered.taken ? "selected" : "the data are not better explained with it";
    considered.evidence_gap = considered.taken ? 0 : gap;
    considered.chi2_drop = 900 + 40 * gap;
    considered.signal_share = considered.taken ? 0.8 : std::max(0.0, 0.5 + 0.02 * gap);
    if (considered.id == "latency" || considered.id == "dynamic_inertia") {
      considered.reason = "cannot be offered: velocities (qd) were not recorded";
      considered.chi2_drop = considered.signal_share = considered.evidence_gap = 0;
      considered.scope.clear();
    }
    gap -= 3.7;
    diagnosis.considered.push_back(considered);
  }
}

void AddRival(const Simulation& simulation, const measure::Finding& rival_finding,
              measure::Diagnosis& diagnosis) {
  const std::vector<Vec3> answer = simulation.Tips(diagnosis.findings);
  const std::vector<Vec3> other = simulation.Tips({rival_finding});
  measure::Rival rival;
  rival.instead_of = "tool_stiffness";
  rival.id = "payload_mass";
  rival.signal_left = 0.012;
  rival.evidence_gap = 1.4;
  for (std::size_t k = 0; k < answer.size(); ++k) {
    rival.shift_W.push_back(other[k] - answer[k]);
    rival.rows.emplace_back(k);
  }
  diagnosis.rivals.push_back(rival);
  diagnosis.next_poses_separate_all = true;
  for (std::size_t k = 0; k < 6; ++k) {
    diagnosis.next_poses.push_back(
        {simulation.moments[9 * k].q, 80, 1e-3 * (1.2 - 0.1 * static_cast<double>(k))});
  }
}

void AddCorrelation(measure::Diagnosis& diagnosis) {
  for (const measure::Finding& finding : diagnosis.findings) {
    for (const model::EffectParameter& parameter :
         effects::WrittenFromActive(finding.effect, finding.covariance).parameters) {
      diagnosis.finding_names.push_back(parameter.name);
    }
  }
  const auto n = static_cast<Eigen::Index>(diagnosis.finding_names.size());
  diagnosis.correlation = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      if (i != j) diagnosis.correlation(i, j) = (i + j) % 2 == 0 ? 0.12 : -0.46;
    }
  }
}

}  // namespace

model::CellModel ExampleCell() {
  model::CellModel cell = HeavyArm();
  cell.robot.name = "Assembly cell 4 <roof & pillar>";
  cell.measurement.reference_temperature_C = 22;
  return cell;
}

measure::Diagnosis ExampleDiagnosis(measure::Verdict verdict) {
  Simulation simulation;
  measure::Diagnosis diagnosis;
  diagnosis.verdict = verdict;
  diagnosis.sigma_m = kSigma;
  diagnosis.sigma_origin = diagnosis.noise_floor_origin = "declared";
  diagnosis.noise_floor_m = std::sqrt(3.0) * kSigma;
  diagnosis.held_out_by = "blocks of time";
  std::vector<measure::Finding>& findings = diagnosis.findings;
  if (verdict == measure::Verdict::kExplained) {
    findings.push_back(
        MakeFinding("joint_compliance", {{"q2", 5.1e-7, 2e-9}, {"q3", 6e-7, 3e-9}}, 0.93));
    findings.push_back(MakeFinding("thermal_growth", {{"alpha", 1.17e-5, 2e-7}}, 0.06));
  } else if (verdict == measure::Verdict::kAmbiguous) {
    findings.push_back(MakeFinding("tool_stiffness", {{"ratio", -0.18, 0.01}}, 0.97));
  } else if (verdict == measure::Verdict::kUnknown) {
    findings.push_back(MakeFinding("joint_compliance", {{"q2", 1.3e-7, 6e-9}}, 0.71));
    findings[0].implausible = "";
    diagnosis.drivers = {"air_pressure_bar"};
  }
  AddRows(simulation, findings, verdict, diagnosis);
  AddSignals(simulation, verdict, diagnosis);
  AddSpectrum(simulation, diagnosis);
  AddCandidateOutcomes(diagnosis);
  AddCorrelation(diagnosis);
  if (verdict == measure::Verdict::kAmbiguous) {
    AddRival(simulation, MakeFinding("payload_mass", {{"scale", 0.2, 0.01}}, 0.96), diagnosis);
  }
  if (verdict == measure::Verdict::kNoEffect) {
    diagnosis.minimum_detectable_m = {{"backlash", 3e-5},
                                      {"joint_compliance", 2.4e-5},
                                      {"thermal_drift", 5.2e-5},
                                      {"tool_stiffness", 2.9e-5}};
  }
  diagnosis.not_recorded = {
      "velocities (qd1_deg_s..) were not recorded: latency cannot be seen",
      "accelerations (qdd1_deg_s2..) were not recorded: dynamic inertia cannot be seen"};
  diagnosis.notes = {"Temperature only rises with time: growth and drift are hard to tell apart."};
  diagnosis.domain.q.assign(6, model::Interval{-1.5, 1.5});
  diagnosis.domain.payload_kg = model::Interval{0, 80};
  diagnosis.domain.temp_C = model::Interval{22, 31};
  return diagnosis;
}

}  // namespace plumbline::test
