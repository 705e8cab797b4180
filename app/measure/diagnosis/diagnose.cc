// Stages of a diagnosis, in the order of execution.
#include "app/measure/diagnosis/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "app/measure/diagnosis/critics/critics.h"
#include "app/measure/diagnosis/critics/explanation_checks.h"
#include "app/measure/diagnosis/critics/reference_dependence.h"
#include "app/measure/diagnosis/critics/signals.h"
#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/design/detectable.h"
#include "app/measure/diagnosis/design/pose_design.h"
#include "app/measure/diagnosis/hypotheses/contradictions.h"
#include "app/measure/diagnosis/hypotheses/declared_errors.h"
#include "app/measure/diagnosis/hypotheses/gross_errors.h"
#include "app/measure/diagnosis/hypotheses/hidden_mistakes.h"
#include "app/measure/diagnosis/linear/alignment.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/prediction/stated_domain.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/search/findings.h"
#include "app/measure/diagnosis/search/identify.h"
#include "app/measure/diagnosis/search/rivals.h"
#include "app/measure/diagnosis/validation/diagnosis_stages.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

// Errors of the rows by kind of observation.

/// Sums of squares over the rows of one kind [m^2].
struct KindSums {
  double rows = 0, before = 0, after = 0, noise = 0;
  double held_out = 0, before_held_out = 0, after_held_out = 0;
};

void Add(const RowTrace& trace, double relative_noise, KindSums& sums) {
  sums.rows += 1;
  sums.before += trace.before.squaredNorm();
  sums.after += trace.after.squaredNorm();
  sums.noise += relative_noise;
  if (!trace.held_out_before || !trace.held_out_after) return;
  sums.held_out += 1;
  sums.before_held_out += trace.held_out_before->squaredNorm();
  sums.after_held_out += trace.held_out_after->squaredNorm();
}

KindError ErrorOf(const std::string& kind, const KindSums& sums, double sigma_m) {
  KindError error;
  error.kind = kind;
  error.rows = static_cast<int>(sums.rows);
  error.before_m = std::sqrt(sums.before / sums.rows);
  error.after_m = std::sqrt(sums.after / sums.rows);
  error.noise_floor_m = sigma_m * std::sqrt(sums.noise / sums.rows);
  if (sums.held_out == 0) return error;
  error.before_held_out_m = std::sqrt(sums.before_held_out / sums.held_out);
  error.after_held_out_m = std::sqrt(sums.after_held_out / sums.held_out);
  return error;
}

/// RMS errors of each kind of observation over the rows that are not outliers, the kind with the
/// most rows first. Errors of different kinds are not comparable: three axes of a point, one of a
/// plane.
std::vector<KindError> KindErrorsOf(const Dataset& data, const Diagnosis& diagnosis) {
  std::map<std::string, KindSums> sums;
  for (const RowIndex row : diagnosis.rows.indices()) {
    const RowTrace& trace = diagnosis.rows[row];
    if (trace.outlier) continue;
    Add(trace, data.numbers[row].LengthVariance(), sums[Describe(trace.kind)]);
  }
  const double sigma_m = data.sigma_m > 0 ? data.sigma_m : diagnosis.sigma_m;
  std::vector<KindError> errors;
  errors.reserve(sums.size());
  for (const auto& [kind, sum] : sums) errors.push_back(ErrorOf(kind, sum, sigma_m));
  std::ranges::stable_sort(errors,
                           [](const KindError& a, const KindError& b) { return a.rows > b.rows; });
  return errors;
}

/// Sets `rms_by_kind`, and with several kinds, the overall figures to those of the first.
void AddKindErrors(const Dataset& data, Diagnosis& diagnosis) {
  diagnosis.rms_by_kind = KindErrorsOf(data, diagnosis);
  if (diagnosis.rms_by_kind.size() < 2) return;
  const KindError& most = diagnosis.rms_by_kind.front();
  diagnosis.rms_before_m = most.before_m;
  diagnosis.rms_after_m = most.after_m;
  diagnosis.noise_floor_m = most.noise_floor_m;
  // The most frequent kind of which rows were held out.
  const auto held_out = std::ranges::find_if(diagnosis.rms_by_kind, [](const KindError& error) {
    return error.before_held_out_m.has_value();
  });
  if (held_out == diagnosis.rms_by_kind.end()) return;
  diagnosis.held_out.before_m = *held_out->before_held_out_m;
  diagnosis.held_out.after_m = *held_out->after_held_out_m;
}

constexpr int kSearchedRows =
    2200;  // larger tables are thinned for the search; the fit and its validation use all rows

/// Share of the model's displacement of the rows (sums of squares) that is not due to the named
/// effects.
double UnnamedShare(const PerRow<RowTrace>& rows, const PerRow<Vec3>& by_the_named) {
  double named = 0, unnamed = 0;
  for (const RowIndex k : rows.indices()) {
    if (rows[k].outlier) continue;
    named += (rows[k].before - by_the_named[k]).squaredNorm();
    unnamed += (by_the_named[k] - rows[k].after).squaredNorm();
  }
  return named + unnamed > 0 ? unnamed / (named + unnamed) : 0;
}

/// The rows with t_s relative to the cell's time zero, and without order of moves if the caller
/// does not know it.
MeasuredTable WithCellTime(const model::CellModel& cell, MeasuredTable table,
                           const DiagnosisOptions& options) {
  const std::optional<double> cell_zero_s = TimeZeroOf(cell);
  if (cell_zero_s && options.time_zero_s) {
    for (MeasuredRow& row : table.rows) {
      if (row.t_s) *row.t_s += *options.time_zero_s - *cell_zero_s;
    }
  }
  if (options.order_unknown) table.recorded.order = false;
  return table;
}

/// Fits the free frames of the declared cell. If rows and cell differ by more than any effect, the
/// error names the mistake.
Result<FittedModel> FittedDeclared(const Task& task) {
  task.Report(0.02, "aligning frames");
  const Result<DeclaredFit> fit = FitDeclared(task.data, task.options.threads);
  if (!fit) return fit.failure();
  if (fit->mistake) return Error{fit->mistake->sentence};
  return FittedModel{fit->model, ErrorsOf(fit->linear)};
}

/// Fits the identified model to all rows with new weights, if the search used a subset.
Result<FitOfAllRows> FitAllRows(const Task& task, const Identified& found, bool thinned) {
  task.Report(0.4, "fitting all rows");
  const Dataset& data = task.data;
  Result<Linearisation> linear = Linearise(data, found.model, false, task.options.threads);
  if (!linear) return Error{linear.error()};
  FitProblem problem = UnitWeightFit(data, task.options.threads);
  problem.sigma_m = found.fit.sigma_m;
  if (!thinned) problem.weights = found.fit.weights;
  FitOfAllRows fit{std::move(problem), found.refit, std::move(linear).value(), {}};
  fit.errors = ErrorsOf(fit.linear);
  if (!thinned) return fit;
  const PerRow<RowResidual> residuals = ResidualsOf(fit.linear);
  const double scatter = std::max(found.fit.sigma_m, RobustSigma(data, residuals));
  fit.problem.weights = HampelWeights(
      data, residuals, found.many_outliers ? scatter : OutlierScale(data, residuals, scatter));
  constexpr int kIterations = 3;  // starts at the fit of the searched rows
  const Result<Refit> refit = RefitModel(fit.problem, found.model, {kIterations});
  if (!refit) return Error{refit.error()};
  linear = Linearise(data, refit->model, false, task.options.threads);
  if (!linear) return Error{linear.error()};
  fit.refit = *refit;
  fit.linear = std::move(linear).value();
  fit.errors = ErrorsOf(fit.linear);
  return fit;
}

void AddNoise(const Task& task, const Identified& found, const PerRow<Vec3>& declared,
              const FitOfAllRows& fit, Diagnosis& diagnosis) {
  const Dataset& data = task.data;
  const bool as_declared = data.sigma_m > 0 && found.fit.sigma_m < 1.1 * data.sigma_m;
  diagnosis.sigma_m = as_declared ? data.sigma_m : found.fit.sigma_m;
  diagnosis.sigma_origin = as_declared ? data.sigma_origin : "residual";
  diagnosis.noise_floor_m =
      std::sqrt(data.noise_per_row()) * (data.sigma_m > 0 ? data.sigma_m : found.fit.sigma_m);
  diagnosis.noise_floor_origin = data.sigma_m > 0 ? data.sigma_origin : "residual";
  diagnosis.noise_in_use_m = std::sqrt(data.noise_per_row()) * found.fit.sigma_m;
  diagnosis.joint_reading_sigma_m = data.reading_sigma_m;
  diagnosis.row_sigma_m = data.row_sigma_m;
  diagnosis.rms_before_m = Rms(declared, fit.problem.weights);
  diagnosis.rms_after_m = Rms(fit.errors, fit.problem.weights);
  for (const RowIndex row : data.row_indices()) {
    if (fit.problem.weights[row] >= kOutlierWeight || data.numbers[row].count == 0) continue;
    diagnosis.outlier_rows.push_back(data.measured(row).line);
  }
}

/// Adds findings, rivals, detection limits and signals.
/// @return  the explanations of the rivals
std::vector<Explanation> Explain(const Task& task, const Identified& found,
                                 const FindingsContext& context, Diagnosis& diagnosis) {
  task.Report(0.43, "comparing rivals");
  AddFindings(context, diagnosis);
  std::vector<Explanation> rivals;
  if (found.unknown) {
    AddDriverRivals(*found.candidate_set, found.best, diagnosis);
  } else if (!found.best.blocks.empty()) {
    rivals = AddRivals(context, found.model, diagnosis);
    for (Rival& rival : diagnosis.rivals) {
      if (!rival.shift_W.empty()) rival.rows = EvenlySpacedRows(task.data, kSearchedRows).items();
    }
  }
  DetectionLimits limits = DetectionLimitsOf(*found.candidate_set, found.candidates);
  diagnosis.minimum_detectable_m = std::move(limits.minimum_detectable_m);
  diagnosis.not_observable = std::move(limits.not_observable);
  if (task.Interrupted()) return rivals;
  task.Report(0.45, "testing signals");
  ResidualSignals signals = SignalsOfResidual(task.data, found);
  diagnosis.signals = std::move(signals.traces);
  diagnosis.spectrum = std::move(signals.spectrum);
  return rivals;
}

/// Adds one trace per row: the measurement, and the residuals before, after and held out.
void AddRows(const Dataset& data, const Dataset& searched, const PerRow<Vec3>& declared,
             const FitOfAllRows& fit, const CorrectedModel& corrected, Diagnosis& diagnosis) {
  std::map<int, RowIndex> searched_of_line;
  for (const RowIndex row : searched.row_indices()) {
    searched_of_line[searched.measured(row).line] = row;
  }
  const HeldOut& held_out = corrected.validation.schemes.front();
  for (const RowIndex row : data.row_indices()) {
    RowTrace& trace = diagnosis.rows.emplace_back();
    trace.line = data.measured(row).line;
    trace.session = data.measured(row).session;
    trace.kind = data.observations[row].kind;
    trace.pose = data.cluster_of[row];
    trace.weight = fit.problem.weights[row];
    trace.outlier = fit.problem.weights[row] < kOutlierWeight;
    const bool point =
        trace.kind == ObservationKind::kPosition || trace.kind == ObservationKind::kPose;
    trace.p_measured = point ? *data.measured(row).measured_W : fit.linear.rows[row].p_W;
    trace.before = declared[row];
    trace.after = corrected.errors[row];
    trace.fold = -1;
    const auto held = searched_of_line.find(trace.line);
    if (held == searched_of_line.end() || !held_out.predicted[held->second]) continue;
    trace.fold = held_out.fold_of[held->second];
    trace.held_out_before = held_out.before[held->second];
    trace.held_out_after = held_out.after[held->second];
  }
  if (diagnosis.discrepancy.empty()) return;
  diagnosis.discrepancy_parameters = corrected.discrepancy_parameters;
  diagnosis.discrepancy_share = UnnamedShare(diagnosis.rows, fit.errors);
}

/// States that the estimated vertical of the base differs from the declared one by more than two
/// degrees.
Opinion OpinionOnTilt(const Dataset& data, const Model& aligned) {
  constexpr double kLevel_rad = 2 * kRadPerDeg;  // compliances hardly change below
  if (!data.frames_free()) return {};
  double most = 0;
  for (const Model::Frames& frames : aligned.frames) {
    const Vec3 up_in_base = frames.X_WB.R.transpose() * Vec3::UnitZ();
    const Vec3 declared = data.cell.robot.X_WB.R.transpose() * Vec3::UnitZ();
    most = std::max(most, std::acos(std::clamp(up_in_base.dot(declared), -1.0, 1.0)));
  }
  if (most <= kLevel_rad) return {};
  Opinion opinion;
  opinion.notes.push_back(
      fmt::format("the vertical of the base differs by {:.1f} deg from the declared one if gravity "
                  "is along the z "
                  "axis of the instrument's frame, as assumed: level the instrument, or transform "
                  "its points to "
                  "a level frame; if it was level, correct base_rpy_deg",
                  most / kRadPerDeg));
  return opinion;
}

/// A diagnosis with some of the references of the cell.
class StartedDiagnosis final : public Attempt {
 public:
  StartedDiagnosis(Dataset data, const DiagnosisOptions& options)
      : data_(std::move(data)), options_(options) {}

  /// Identifies the model and tests the references. Called once, before all else.
  Result<void> Identify();
  const Diagnosis& so_far() const override { return diagnosis_; }
  Result<Diagnosis> Finish() override;

 private:
  Task task() const { return {data_, options_}; }
  /// Progress of a stage from its own share.
  std::function<void(double, const std::string&)> ProgressBetween(double from, double to) const {
    return [this, from, to](double share, const std::string& what) {
      task().Report(from + (to - from) * share, what);
    };
  }

  Dataset data_;
  const DiagnosisOptions& options_;
  std::optional<Dataset> searched_;
  std::optional<FittedModel> declared_;
  std::optional<Identified> found_;  ///< refers to `searched_`
  std::optional<FitOfAllRows> fit_;  ///< refers to `data_`
  Diagnosis diagnosis_;
};

Result<void> StartedDiagnosis::Identify() {
  Result<FittedModel> declared = FittedDeclared(task());
  if (!declared) return declared.failure();
  declared_ = std::move(declared).value();
  CopyBasePosesToRows(declared_->model, data_);
  searched_.emplace(SelectRows(data_, EvenlySpacedRows(data_, kSearchedRows)));
  if (const auto change = HiddenUnitChange(*searched_, options_, ProgressBetween(0.03, 0.05))) {
    return Error{*change};
  }
  Result<Identified> found =
      measure::Identify(*searched_, declared_->model, options_, ProgressBetween(0.05, 0.35));
  if (!found) return found.failure();
  found_.emplace(std::move(found).value());
  if (const auto mistake = HiddenMistake(*found_, data_, options_, ProgressBetween(0.35, 0.4)))
    return Error{*mistake};
  const Result<TestedReferences> tested = TestReferences(*found_);
  if (!tested) return tested.failure();
  // A wrong distance imitates a move of one of its artefacts; it is set aside first.
  const bool with_moves = tested->references.contradicting.empty();
  const DeclaredErrorSearch search = SearchDeclaredErrors(*found_, with_moves, options_.threads);
  if (search.likeliest && search.likeliest->certain()) {
    return Error{SentenceOf(*search.likeliest, *found_)};
  }
  Result<FitOfAllRows> fit = FitAllRows(task(), *found_, searched_->rows() < data_.rows());
  if (!fit) return fit.failure();
  fit_.emplace(std::move(fit).value());
  if (task().Interrupted()) return Task::InterruptedError();
  diagnosis_.notes = data_.notes;
  FoldOpinions({OpinionOnTilt(found_->fit.data, found_->aligned)}, diagnosis_);
  diagnosis_.not_recorded = data_.not_recorded;
  AddNoise(task(), *found_, declared_->errors, *fit_, diagnosis_);
  const FindingsContext context{found_->fit, *found_->candidate_set, found_->best,
                                fit_->refit, found_->refit.chi2,     found_->ranked,
                                options_};
  const std::vector<Explanation> rivals = Explain(task(), *found_, context, diagnosis_);
  if (task().Interrupted()) return Task::InterruptedError();
  const auto without_references = EvaluateWithoutReferences(*found_, options_.threads);
  if (!without_references) return without_references.failure();
  diagnosis_.references = tested->references;
  Criticise({*found_, *fit_, *tested, *without_references, search, diagnosis_,
             RobustSigma(data_, ResidualsOf(fit_->linear))},
            diagnosis_);
  diagnosis_.considered = CandidateOutcomes(context, found_->candidates, diagnosis_.rivals);
  if (rivals.empty()) return {};
  task().Report(0.46, "planning further measurements");
  AddNextPoses(*found_->candidate_set, found_->model, found_->fit.weights, found_->best, rivals,
               options_, diagnosis_);
  if (task().Interrupted()) return Task::InterruptedError();
  return {};
}

Result<Diagnosis> StartedDiagnosis::Finish() {
  Result<CorrectedModel> validated = Validated(task(), *found_, *fit_, diagnosis_);
  if (!validated) return validated.failure();
  CorrectedModel& corrected = validated.value();
  const double parameters = ParametersOf(*found_, found_->fit.data);
  CheckExplanation({found_->fit, corrected.validation.schemes.front(), parameters,
                    RmsBetween(fit_->errors, corrected.errors, fit_->problem.weights),
                    ResidualScatter(fit_->problem, ResidualsOf(fit_->linear), parameters)},
                   diagnosis_);
  Withhold(*declared_, corrected, diagnosis_);
  ShrinkUnconfirmed(task(), *found_, *fit_, *declared_, corrected, diagnosis_);
  AddRows(data_, *searched_, declared_->errors, *fit_, corrected, diagnosis_);
  AddKindErrors(data_, diagnosis_);
  AddDomain(task(), *found_, *declared_, *fit_, corrected, diagnosis_);
  task().Report(1, "done");
  return std::move(diagnosis_);
}

}  // namespace

Result<Diagnosis> DiagnoseRows(const model::CellModel& cell, const MeasuredTable& measured,
                               const DiagnosisOptions& options) {
  // Each repetition without a reference goes on where the one before it stopped.
  double from = 0, reported = 0;
  DiagnosisOptions of_attempts = options;
  if (options.progress) {
    of_attempts.progress = [&](double share, const std::string& what) {
      reported = from + (1 - from) * share;
      options.progress(reported, what);
    };
  }
  const auto start = [&](const model::CellModel& with) -> Result<std::unique_ptr<Attempt>> {
    from = reported;
    Result<Dataset> data = DatasetFrom(with, WithCellTime(with, measured, options));
    if (!data) return data.failure();
    auto attempt = std::make_unique<StartedDiagnosis>(std::move(data).value(), of_attempts);
    if (const Result<void> identified = attempt->Identify(); !identified) {
      return identified.failure();
    }
    return std::unique_ptr<Attempt>(std::move(attempt));
  };
  return SetAsideContradictions(cell, of_attempts, start);
}

}  // namespace plumbline::measure
