#include "app/siblings/siblings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <utility>

#include "app/config/cell_reader.h"
#include "app/diagnosis/residual_layout.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline::siblings {
namespace {

/// Diagnoses the siblings; those that cannot be diagnosed are removed, with a note.
std::vector<Arm> Diagnosed(std::vector<Arm> arms, const Engine& engine,
                           const diagnosis::DiagnosisOptions& options, double share,
                           std::vector<std::string>& notes) {
  std::vector<Arm> diagnosed;
  for (std::size_t k = 0; k < arms.size(); ++k) {
    diagnosis::DiagnosisOptions own;
    own.threads = options.threads;
    own.next_poses = 0;
    own.order_unknown = options.order_unknown;
    own.interrupted = options.interrupted;
    own.progress = [&](double done, const std::string&) {
      if (!options.progress) return;
      options.progress(share * (static_cast<double>(k) + done) / static_cast<double>(arms.size()),
                       "diagnosing sibling " + arms[k].name);
    };
    Result<diagnosis::Diagnosis> found = engine(arms[k].cell, arms[k].rows, own);
    if (!found) {
      notes.push_back(fmt::format("sibling {} was left out: {}", arms[k].name, found.error()));
      continue;
    }
    arms[k].diagnosis = std::move(found).value();
    diagnosed.push_back(std::move(arms[k]));
  }
  return diagnosed;
}

/// Options of the arm's own diagnosis, whose progress goes from `from` to `to`.
diagnosis::DiagnosisOptions Within(const diagnosis::DiagnosisOptions& options, double from,
                                   double to) {
  diagnosis::DiagnosisOptions part = options;
  if (options.progress) {
    part.progress = [&options, from, to](double share, const std::string& what) {
      options.progress(from + (to - from) * share, what);
    };
  }
  return part;
}

std::vector<effects::ActiveEffect> MeanEffects(const std::vector<SizePrior>& prior,
                                               const model::CellModel& cell) {
  std::vector<SizeKey> keys;
  std::vector<double> means;
  for (const SizePrior& one : prior) {
    keys.push_back(one.key);
    means.push_back(one.pooled.mean);
  }
  std::vector<effects::ActiveEffect> found =
      EffectsWith(keys, means, effects::PrismaticJoints(cell.robot));
  for (effects::ActiveEffect& effect : found) {
    const auto size = static_cast<Eigen::Index>(effect.values.size());
    effect.covariance = Eigen::MatrixXd::Zero(size, size);
    for (Eigen::Index i = 0; i < size; ++i) {
      const SizeKey key{effect.term.effect, effect.term.word,
                        effect.term.parameters[static_cast<std::size_t>(i)]};
      const auto of = std::find_if(prior.begin(), prior.end(),
                                   [&key](const SizePrior& one) { return one.key == key; });
      effect.covariance(i, i) = std::pow(of->pooled.next_sd(), 2);
    }
  }
  return found;
}

model::CellModel With(model::CellModel cell, const std::vector<effects::ActiveEffect>& effects) {
  for (const effects::ActiveEffect& effect : effects) {
    cell.effects.push_back(effects::WrittenFromActive(effect, effect.covariance));
  }
  return cell;
}

/// Errors of the rows under the declared cell, instead of under the extended one, by line.
void StateErrorsBefore(const diagnosis::Diagnosis& without, diagnosis::Diagnosis& with) {
  std::map<int, Vec3> before;
  std::map<int, std::optional<Vec3>> held_out_before;
  for (const diagnosis::RowTrace& row : without.rows) {
    before[row.line] = row.before;
    held_out_before[row.line] = row.held_out_before;
  }
  for (diagnosis::RowTrace& row : with.rows) {
    if (!before.contains(row.line)) continue;
    row.before = before.at(row.line);
    row.held_out_before = held_out_before.at(row.line);
  }
  with.rms_before_m = without.rms_before_m;
  with.held_out.before_m = without.held_out.before_m;
  for (diagnosis::HeldOutError& error : with.held_out_by_all) {
    for (const diagnosis::HeldOutError& of : without.held_out_by_all) {
      if (of.by == error.by) error.before_m = of.before_m;
    }
  }
  for (diagnosis::KindError& error : with.rms_by_kind) {
    for (const diagnosis::KindError& of : without.rms_by_kind) {
      if (of.kind != error.kind) continue;
      error.before_m = of.before_m;
      error.before_held_out_m = of.before_held_out_m;
    }
  }
}

/// Adds the siblings' effects to the findings. They are as certain as the siblings' own causes: if
/// one of these is not explained, each is a doubt.
void AddFindings(const std::vector<effects::ActiveEffect>& applied, const std::vector<Arm>& arms,
                 const std::string& origin, diagnosis::Diagnosis& answer) {
  const bool explained = std::all_of(arms.begin(), arms.end(), [](const Arm& arm) {
    return arm.diagnosis.verdict == diagnosis::Verdict::kExplained;
  });
  std::vector<diagnosis::Finding> findings;
  for (const effects::ActiveEffect& effect : applied) {
    diagnosis::Finding& finding = findings.emplace_back();
    finding.effect = effect;
    finding.covariance = effect.covariance;
    finding.origin = origin;
    const Eigen::Map<const Eigen::VectorXd> values(effect.values.data(),
                                                   static_cast<Eigen::Index>(effect.values.size()));
    finding.p_value = statistics::ChiSquareTail(values.dot(effect.covariance.ldlt().solve(values)),
                                                static_cast<double>(values.size()));
    if (explained) continue;
    const model::WrittenEffect written = effects::WrittenFromActive(effect, effect.covariance);
    answer.doubts.push_back({written.id, written.scope,
                             "it was taken from siblings whose own causes are not all explained"});
  }
  answer.findings.insert(answer.findings.begin(), findings.begin(), findings.end());
  if (answer.verdict != diagnosis::Verdict::kNoEffect) return;
  answer.verdict = explained ? diagnosis::Verdict::kExplained : diagnosis::Verdict::kAmbiguous;
}

/// True if the held-out rows are better with the siblings by more than the standard error of the
/// mean difference of their squared errors (a judgement; few rows rarely show more).
bool BetterWith(const diagnosis::Diagnosis& with, const diagnosis::Diagnosis& without,
                double factor) {
  const auto written = [](const diagnosis::Diagnosis& answer, const diagnosis::RowTrace& row) {
    return answer.withheld.empty() ? row.held_out_after : row.held_out_before;
  };
  std::map<int, double> square_without;
  for (const diagnosis::RowTrace& row : without.rows) {
    if (!row.outlier && written(without, row)) {
      square_without[row.line] = written(without, row)->squaredNorm();
    }
  }
  std::vector<double> gains;
  for (const diagnosis::RowTrace& row : with.rows) {
    if (!written(with, row) || row.outlier || !square_without.contains(row.line)) continue;
    gains.push_back(square_without.at(row.line) -
                    factor * factor * written(with, row)->squaredNorm());
  }
  if (gains.size() < 3) return false;
  const double count = static_cast<double>(gains.size());
  const double mean = std::accumulate(gains.begin(), gains.end(), 0.0) / count;
  double squares = 0;
  for (const double gain : gains) squares += std::pow(gain - mean, 2);
  return mean > std::sqrt(squares / (count - 1) / count);
}

std::string Names(const std::vector<std::string>& arms) {
  return fmt::format("{}", fmt::join(arms, ", "));
}

/// For p parameters fitted to n residuals, the RMS of new residuals over that of the fitted ones,
/// sqrt((n + p) / (n - p)); nullopt if there are too few residuals.
std::optional<double> FactorForNewRows(double parameters, const diagnosis::Diagnosis& diagnosis) {
  double residuals = 0;
  for (const diagnosis::RowTrace& row : diagnosis.rows) {
    residuals += row.outlier ? 0 : diagnosis::ResidualsOf(row.kind);
  }
  if (residuals < parameters + 1) return std::nullopt;
  return std::sqrt((residuals + parameters) / (residuals - parameters));
}

/// Widens every stated error of held-out rows and of new points, because those rows took part in
/// the update of the prior.
void Widen(double factor, diagnosis::Diagnosis& diagnosis) {
  const auto widen = [factor](diagnosis::HeldOutError& error) {
    for (double* value :
         {&error.before_m, &error.after_m, &error.after_low_m, &error.after_high_m}) {
      *value *= factor;
    }
  };
  widen(diagnosis.held_out);
  for (diagnosis::HeldOutError& error : diagnosis.held_out_by_all) widen(error);
  for (diagnosis::KindError& error : diagnosis.rms_by_kind) {
    if (error.before_held_out_m) *error.before_held_out_m *= factor;
    if (error.after_held_out_m) *error.after_held_out_m *= factor;
  }
  model::Domain& domain = diagnosis.domain;
  for (std::optional<double>* sigma_m :
       {&domain.residual_sigma_m, &domain.distant_sigma_m, &domain.declared_sigma_m}) {
    if (*sigma_m) **sigma_m *= factor;
  }
}

/// Held-out error of the model that an answer writes; nullopt if no row could be held out.
std::optional<double> HeldOutOf(const diagnosis::Diagnosis& answer) {
  if (answer.held_out_by.empty()) return std::nullopt;
  return answer.withheld.empty() ? answer.held_out.after_m : answer.held_out.before_m;
}

/// Below this probability the arm counts as different from its siblings. The level is approximate:
/// the spread of few siblings is an upper limit, not known.
constexpr double kDifferentArm = 0.01;

}  // namespace

Result<Arm> ReadArm(const std::string& folder, config::FaultList& faults) {
  namespace fs = std::filesystem;
  Arm arm;
  arm.name = fs::path(folder).lexically_normal().string();
  config::FaultList own;
  const auto cell = config::ReadCell(CellFileOf(folder), own);
  std::optional<table::MeasuredTable> rows;
  if (cell) {
    arm.cell = *cell;
    rows = table::ReadTable(RowsFileOf(folder), cell->robot.joints, own);
  }
  if (!cell || !rows) {
    return Error{fmt::format("{}a sibling is a folder with its cell.toml and its measured.csv",
                             config::FaultsText(own))};
  }
  faults.Append(own);
  arm.rows = std::move(*rows);
  return arm;
}

std::string CellFileOf(const std::string& folder) {
  return (std::filesystem::path(folder) / "cell.toml").string();
}

std::string RowsFileOf(const std::string& folder) {
  return (std::filesystem::path(folder) / "measured.csv").string();
}

std::string DifferenceOf(const model::CellModel& a, const model::CellModel& b) {
  constexpr double kLength_m = 1e-3, kAngle_rad = 0.1 * kRadPerDeg, kShare = 0.01;
  if (a.robot.size() != b.robot.size()) {
    return fmt::format("it has {} joints, not {}", b.robot.size(), a.robot.size());
  }
  if (a.robot.convention != b.robot.convention) return "its Denavit-Hartenberg convention differs";
  if (!a.effects.empty() || !b.effects.empty()) {
    return fmt::format("{} has effects of its own: give the cell as it was declared",
                       b.effects.empty() ? "the other cell" : "its cell");
  }
  const auto equal = [](const std::optional<double>& one, const std::optional<double>& other) {
    if (!one || !other) return one.has_value() == other.has_value();
    return std::abs(*one - *other) <= kShare * std::max(std::abs(*one), std::abs(*other));
  };
  for (int i = 0; i < a.robot.size(); ++i) {
    const model::Joint& one = a.robot.joints[static_cast<std::size_t>(i)];
    const model::Joint& other = b.robot.joints[static_cast<std::size_t>(i)];
    const bool same = one.type == other.type && one.sign == other.sign &&
                      std::abs(one.a_m - other.a_m) <= kLength_m &&
                      std::abs(one.d_m - other.d_m) <= kLength_m &&
                      std::abs(one.alpha_rad - other.alpha_rad) <= kAngle_rad &&
                      std::abs(one.theta_offset_rad - other.theta_offset_rad) <= kAngle_rad;
    if (!same) return fmt::format("its nominal joint {} differs", i + 1);
    if (!equal(one.compliance_rad_per_Nm, other.compliance_rad_per_Nm)) {
      return fmt::format("the declared compliance of its joint {} differs", i + 1);
    }
    if (!equal(one.link_mass_kg, other.link_mass_kg)) {
      return fmt::format("the declared mass of its link {} differs", i + 1);
    }
  }
  return {};
}

Result<diagnosis::Diagnosis> DiagnoseWithSiblings(const model::CellModel& cell,
                                                  const table::MeasuredTable& rows,
                                                  std::vector<Arm> siblings, const Engine& engine,
                                                  const diagnosis::DiagnosisOptions& options) {
  diagnosis::SiblingEvidence evidence;
  std::vector<std::string> notes;
  const double each = 1.0 / static_cast<double>(siblings.size() + 2);
  const double own = each * static_cast<double>(siblings.size());
  const std::vector<Arm> arms = Diagnosed(std::move(siblings), engine, options, own, notes);
  for (const Arm& arm : arms) evidence.arms.push_back(arm.name);
  Result<diagnosis::Diagnosis> without = engine(cell, rows, Within(options, own, own + each));
  if (!without) return Error{without.error()};
  diagnosis::Diagnosis answer = *without;
  const auto finish = [&] {
    const std::string of = evidence.arms.empty() ? "" : " (" + Names(evidence.arms) + ")";
    notes.insert(notes.begin(), fmt::format("siblings{}: {}", of, evidence.reason));
    answer.notes.insert(answer.notes.begin(), notes.begin(), notes.end());
    answer.siblings = evidence;
    return answer;
  };

  const auto not_used = [&](const std::string& reason) {
    evidence.reason = "not used: " + reason;
    return finish();
  };
  constexpr double kAtNoise = 1.1;
  if (without->verdict == diagnosis::Verdict::kNoEffect &&
      without->rms_before_m <= kAtNoise * without->noise_floor_m) {
    return not_used("the declared cell predicts these rows within their noise already");
  }
  if (arms.size() < 2) return not_used("at least two siblings that can be diagnosed are needed");
  const std::vector<SizePrior> prior = PriorFrom(arms, options.threads, notes);
  if (prior.empty()) {
    return not_used("no size of an effect of the arm was found in at least two, and half, of them");
  }
  Arm arm{"", cell, rows, *without};
  if (options.order_unknown) arm.rows.recorded.order = false;
  const std::vector<effects::ActiveEffect> mean = MeanEffects(prior, cell);
  for (const effects::ActiveEffect& effect : mean) {
    evidence.common.push_back({effect, effect.covariance, 1, 0, {}, 0});
  }
  const Result<double> declared = AlignedRms(cell, arm, options.threads);
  const Result<double> predicted = AlignedRms(With(cell, mean), arm, options.threads);
  const Result<Posterior> posterior = UpdatedBy(arm, prior, options.threads);
  if (!declared) return not_used(declared.error());
  if (!predicted) return not_used(predicted.error());
  if (!posterior) return not_used(posterior.error());
  evidence.declared_m = *declared;
  evidence.predicted_m = *predicted;
  if (posterior->p_value < kDifferentArm) {
    return not_used(fmt::format(
        "this arm differs from its siblings (p = {:.1g}); what they have in common predicts its "
        "rows "
        "to {:.3f} mm, the declared cell to {:.3f} mm",
        posterior->p_value, kMmPerMetre * evidence.predicted_m, kMmPerMetre * evidence.declared_m));
  }
  const model::CellModel extended = With(cell, posterior->effects);
  Result<diagnosis::Diagnosis> with = engine(extended, rows, Within(options, own + each, 1));
  if (!with) return not_used("with them the rows cannot be diagnosed: " + with.error());
  const std::optional<double> factor = FactorForNewRows(posterior->parameters, *with);
  const std::optional<double> held_out_without = HeldOutOf(*without);
  if (!factor || !held_out_without || !HeldOutOf(*with)) {
    return not_used("too few rows to hold any out, so that nothing can confirm them");
  }
  Widen(*factor, with.value());
  evidence.held_out_without_m = *held_out_without;
  evidence.held_out_with_m = *HeldOutOf(*with);
  const std::string errors = fmt::format(
      "the held-out error is {:.3f} mm with them and {:.3f} mm without",
      kMmPerMetre * evidence.held_out_with_m, kMmPerMetre * evidence.held_out_without_m);
  if (!BetterWith(*with, *without, *factor)) return not_used(errors + ", no clear gain");
  evidence.used = true;
  answer = std::move(with).value();
  StateErrorsBefore(*without, answer);
  AddFindings(posterior->effects, arms, "siblings: " + Names(evidence.arms), answer);
  std::vector<std::string> ids;
  for (const effects::ActiveEffect& effect : posterior->effects) {
    ids.emplace_back(effect.term.effect->traits().id);
  }
  evidence.applied = posterior->effects;
  evidence.reason = fmt::format(
      "the first effects are what they have in common ({}), adjusted to these rows. The declared "
      "cell "
      "predicts the rows to {:.3f} mm, the siblings' mean alone to {:.3f} mm; {}",
      fmt::join(ids, ", "), kMmPerMetre * evidence.declared_m, kMmPerMetre * evidence.predicted_m,
      errors);
  return finish();
}

}  // namespace plumbline::siblings
