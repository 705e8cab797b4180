#include "app/siblings/siblings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "app/config/cell_reader.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"

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

std::string Names(const std::vector<std::string>& arms) {
  return fmt::format("{}", fmt::join(arms, ", "));
}

/// Widens the stated errors, because the held-out rows took part in the update: for p parameters
/// fitted to n residuals, the mean square of new residuals is (n + p) / (n - p) times that of the
/// fitted ones.
void CountFittedSizes(double parameters, diagnosis::Diagnosis& diagnosis) {
  double residuals = 0;
  for (const diagnosis::RowTrace& row : diagnosis.rows) residuals += row.outlier ? 0 : 3;
  const double factor = residuals > parameters + 1
                            ? std::sqrt((residuals + parameters) / (residuals - parameters))
                            : HUGE_VAL;
  for (std::optional<double>* sigma_m :
       {&diagnosis.domain.residual_sigma_m, &diagnosis.domain.distant_sigma_m}) {
    if (*sigma_m) **sigma_m *= factor;
  }
  diagnosis.held_out.after_m *= factor;
}

/// Below this probability the arm counts as different from its siblings.
constexpr double kDifferentArm = 0.01;

}  // namespace

Result<Arm> ReadArm(const std::string& folder) {
  namespace fs = std::filesystem;
  Arm arm;
  arm.name = fs::path(folder).lexically_normal().filename().string();
  if (arm.name.empty()) arm.name = fs::path(folder).lexically_normal().parent_path().filename();
  config::FaultList faults;
  const std::string cell_file = (fs::path(folder) / "cell.toml").string();
  const auto cell = config::ReadCell(cell_file, faults);
  std::optional<table::MeasuredTable> rows;
  if (cell) {
    arm.cell = *cell;
    rows =
        table::ReadTable((fs::path(folder) / "measured.csv").string(), cell->robot.joints, faults);
  }
  if (!cell || !rows) {
    return Error{fmt::format("{}a sibling is a folder with its cell.toml and its measured.csv",
                             config::FaultsText(faults))};
  }
  arm.rows = std::move(*rows);
  return arm;
}

std::string DifferenceOf(const model::CellModel& a, const model::CellModel& b) {
  constexpr double kLength_m = 1e-3, kAngle_rad = 0.1 * kRadPerDeg;
  if (a.robot.size() != b.robot.size()) {
    return fmt::format("it has {} joints, not {}", b.robot.size(), a.robot.size());
  }
  if (a.robot.convention != b.robot.convention) return "its Denavit-Hartenberg convention differs";
  for (int i = 0; i < a.robot.size(); ++i) {
    const model::Joint& one = a.robot.joints[static_cast<std::size_t>(i)];
    const model::Joint& other = b.robot.joints[static_cast<std::size_t>(i)];
    const bool same = one.type == other.type && one.sign == other.sign &&
                      std::abs(one.a_m - other.a_m) <= kLength_m &&
                      std::abs(one.d_m - other.d_m) <= kLength_m &&
                      std::abs(one.alpha_rad - other.alpha_rad) <= kAngle_rad &&
                      std::abs(one.theta_offset_rad - other.theta_offset_rad) <= kAngle_rad;
    if (!same) return fmt::format("its nominal joint {} differs", i + 1);
  }
  return {};
}

Result<SiblingDiagnosis> DiagnoseWithSiblings(const model::CellModel& cell,
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
  SiblingDiagnosis result{*without, cell, {}};
  const auto finish = [&] {
    diagnosis::Diagnosis& answer = result.diagnosis;
    notes.insert(notes.begin(), "siblings (" + Names(evidence.arms) + "): " + evidence.reason);
    answer.notes.insert(answer.notes.begin(), notes.begin(), notes.end());
    answer.siblings = evidence;
    return result;
  };

  const Arm arm{"", cell, rows, *without};
  std::vector<SizePrior> prior;
  if (arms.size() >= 2) {
    Result<std::vector<SizePrior>> found = PriorFrom(arms, options.threads);
    if (!found) return Error{"sibling " + found.error()};
    prior = std::move(found).value();
  }
  if (!prior.empty()) {
    const std::vector<effects::ActiveEffect> mean = MeanEffects(prior, cell);
    for (const effects::ActiveEffect& effect : mean) {
      evidence.common.push_back({effect, effect.covariance, 1, 0, {}, 0});
    }
    const Result<double> declared = AlignedRms(cell, arm, options.threads);
    const Result<double> predicted = AlignedRms(With(cell, mean), arm, options.threads);
    if (!declared) return Error{declared.error()};
    if (!predicted) return Error{predicted.error()};
    evidence.declared_m = *declared;
    evidence.predicted_m = *predicted;
  }
  if (arms.size() < 2) {
    evidence.reason = "fewer than two siblings could be diagnosed; at least two are needed";
    return finish();
  }
  if (prior.empty()) {
    evidence.reason = "no size of an effect was found in at least half of the siblings";
    return finish();
  }
  const Result<Posterior> posterior = UpdatedBy(arm, prior, options.threads);
  if (!posterior) return Error{posterior.error()};
  if (posterior->p_value < kDifferentArm) {
    evidence.reason = fmt::format(
        "not used: this arm differs from its siblings (p = {:.1g}); what they have in common "
        "predicts "
        "its rows to {:.3f} mm, the declared cell to {:.3f} mm",
        posterior->p_value, kMmPerMetre * evidence.predicted_m, kMmPerMetre * evidence.declared_m);
    return finish();
  }
  const model::CellModel extended = With(cell, posterior->effects);
  Result<diagnosis::Diagnosis> with = engine(extended, rows, Within(options, own + each, 1));
  if (!with) {
    evidence.reason = "with them the rows cannot be diagnosed: " + with.error();
    return finish();
  }
  CountFittedSizes(posterior->parameters, with.value());
  evidence.held_out_without_m = without->held_out.after_m;
  evidence.held_out_with_m = with->held_out.after_m;
  const bool held_out = !without->held_out_by.empty() && !with->held_out_by.empty();
  evidence.used = !held_out || evidence.held_out_with_m < evidence.held_out_without_m;
  const std::string errors =
      held_out ? fmt::format("the held-out error is {:.3f} mm with them and {:.3f} mm without",
                             kMmPerMetre * evidence.held_out_with_m,
                             kMmPerMetre * evidence.held_out_without_m)
               : std::string("too few rows to hold any out");
  if (!evidence.used) {
    evidence.reason = "not used: " + errors;
    return finish();
  }
  result.diagnosis = std::move(with).value();
  result.effects.assign(extended.effects.begin() + static_cast<std::ptrdiff_t>(cell.effects.size()),
                        extended.effects.end());
  for (model::WrittenEffect& effect : result.effects) {
    effect.from_file = fmt::format("siblings: {}", Names(evidence.arms));
  }
  result.cell = extended;
  std::vector<std::string> ids;
  for (const model::WrittenEffect& effect : result.effects) ids.push_back(effect.id);
  evidence.reason = fmt::format(
      "the declared cell was extended by what they have in common ({}), adjusted to these rows; "
      "verdict and effects refer to what remains. Without them the error was {:.3f} mm, their mean "
      "alone predicts {:.3f} mm; {}",
      fmt::join(ids, ", "), kMmPerMetre * evidence.declared_m, kMmPerMetre * evidence.predicted_m,
      errors);
  return finish();
}

}  // namespace plumbline::siblings
