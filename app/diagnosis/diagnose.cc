#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/diagnosis/alignment.h"
#include "app/diagnosis/detectable.h"
#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/explanation_checks.h"
#include "app/diagnosis/findings.h"
#include "app/diagnosis/gross_errors.h"
#include "app/diagnosis/identify.h"
#include "app/diagnosis/next_poses.h"
#include "app/diagnosis/periodic_search.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/statistics.h"
#include "app/diagnosis/unknown.h"
#include "app/diagnosis/validation.h"
#include "app/diagnosis/words.h"

namespace plumbline {
namespace {

constexpr int kFlips = 99;
constexpr int kSearchedRows = 2200;  // more are thinned for the search; all are fitted and judged
constexpr int kSignalRows = 1000;
constexpr double kRough = 1.5;     // a rest of this many declared sigmas is more than noise
constexpr double kFollows = 0.02;  // p-value of a signal that a rough rest follows

double Rms(const std::vector<Vec3>& residuals, const std::vector<double>& weights) {
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    if (weights[k] < kOutlierWeight) continue;
    sum += residuals[k].squaredNorm();
    count += 1;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

/// What the rest, after all that was found, still follows. Asked of the rows searched, told with
/// the values of all.
void AddSignals(const Dataset& data, const Dataset& all, const Identified& found,
                const DiagnosisOptions& options, Diagnosis& diagnosis) {
  const LinearProblem few(data, found.linear, found.model, Every(data.rows(), kSignalRows),
                          found.weights, found.sigma_m, options.threads);
  Pool pool(few);
  std::vector<int> support;
  for (const int block : found.best.blocks) {
    support.push_back(pool.Add(found.pool->blocks()[static_cast<std::size_t>(block)]));
  }
  const Eigen::VectorXd rest = pool.Residual(pool.Fit(support));
  diagnosis.signals = SignalsOf(few, rest, kFlips);
  for (std::size_t s = 0; s < diagnosis.signals.size(); ++s) {
    diagnosis.signals[s].values = all.signals[s].values;
  }
  for (const PeriodicLine& line : PeriodicLines(few, rest)) {
    diagnosis.spectrum.push_back({line.joint, line.cycles_per_turn, line.amplitude_rad});
  }
}

/// True where the repeats scatter less than the rest by more than chance and `kRough`: what remains
/// is no noise, whatever was declared.
bool RepeatsContradict(const Dataset& data, double rest_sigma_m, double rest_freedom) {
  constexpr double kChance = 0.01;
  if (data.repeat_sigma_m <= 0) return false;
  const double noise_m =
      std::max(data.sigma_m, std::hypot(data.repeat_sigma_m, data.reading_sigma_m));
  if (rest_sigma_m < kRough * noise_m) return false;
  // A variance from a median holds about 0.37 of what the mean of squares would.
  constexpr double kOfMedian = 0.37;
  const double ratio = rest_sigma_m / std::hypot(data.repeat_sigma_m, data.reading_sigma_m);
  return FisherTail(ratio * ratio, kOfMedian * rest_freedom, kOfMedian * data.repeat_freedom) <
         kChance;
}

void Judge(const Dataset& data, const Identified& found, double rest_sigma_m,
           Diagnosis& diagnosis) {
  if (found.unknown) {
    diagnosis.verdict = Verdict::kUnknown;
    for (const int block : found.best.blocks) {
      const Block& of = found.pool->blocks()[static_cast<std::size_t>(block)];
      if (of.empirical()) diagnosis.drivers.push_back(of.term.drivers.front());
    }
  } else if (found.best.blocks.empty()) {
    diagnosis.verdict = Verdict::kNoEffect;
  } else {
    diagnosis.verdict = diagnosis.rivals.empty() ? Verdict::kExplained : Verdict::kAmbiguous;
  }
  diagnosis.noise_in_use_m = std::sqrt(static_cast<double>(data.axes())) * found.sigma_m;
  if (data.sigma_m <= 0 || rest_sigma_m < kRough * data.sigma_m) return;
  diagnosis.notes.push_back(
      fmt::format("what remains, {:.3g} mm on one axis, is {:.1f} times the noise of {:.3g} mm",
                  1e3 * rest_sigma_m, rest_sigma_m / data.sigma_m, 1e3 * data.sigma_m));
  for (const SignalTrace& signal : diagnosis.signals) {
    const bool named = std::find(diagnosis.drivers.begin(), diagnosis.drivers.end(), signal.name) !=
                       diagnosis.drivers.end();
    if (signal.p_value < kFollows && !named) diagnosis.drivers.push_back(signal.name);
  }
  const double freedom = static_cast<double>(data.rows() * data.axes()) -
                         static_cast<double>(found.best.columns.size());
  if (RepeatsContradict(data, rest_sigma_m, freedom)) {
    diagnosis.notes.push_back(
        fmt::format("repeats scatter by {:.3g} mm on one axis only: what remains is no noise",
                    1e3 * data.repeat_sigma_m));
    diagnosis.verdict = Verdict::kUnknown;
  }
  if (!diagnosis.drivers.empty()) diagnosis.verdict = Verdict::kUnknown;
  diagnosis.declared_noise_too_small =
      diagnosis.verdict != Verdict::kUnknown && data.cell.measurement.sigma_m.has_value();
}

/// 3-D RMS of the difference of two residuals over the rows that are no outliers.
double RmsBetween(std::vector<Vec3> a, const std::vector<Vec3>& b,
                  const std::vector<double>& weights) {
  for (std::size_t k = 0; k < a.size(); ++k) a[k] -= b[k];
  return Rms(a, weights);
}

/// The errors of every way, and those of blocks of time where they always stood.
void TellHeldOut(const Validation& validation, Diagnosis& diagnosis) {
  diagnosis.held_out_by_all = validation.errors;
  for (const HeldOutError& error : validation.errors) {
    if (error.by != validation.ways.front().by) continue;
    diagnosis.held_out = error;
    diagnosis.held_out_by = error.by;
  }
}

/// The share of what the model moves at the rows that is not the named effects': sums of squares.
double UnnamedShare(const std::vector<RowTrace>& rows, const std::vector<Vec3>& by_the_named) {
  double named = 0, unnamed = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].outlier) continue;
    named += (rows[k].before - by_the_named[k]).squaredNorm();
    unnamed += (by_the_named[k] - rows[k].after).squaredNorm();
  }
  return named + unnamed > 0 ? unnamed / (named + unnamed) : 0;
}

/// The model with the remainder's effects, its free frames fitted anew.
Result<Model> WithRemainder(const Dataset& data, Model model, const std::vector<Finding>& remainder,
                            const std::vector<double>& weights, double sigma_m,
                            const DiagnosisOptions& options) {
  for (const Finding& finding : remainder) model.effects.push_back(finding.effect);
  if (!data.frames_free() && !data.tip_free()) return model;
  RefitOptions frames;
  frames.rows = Every(data.rows(), data.rows());
  frames.weights = weights;
  frames.sigma_m = sigma_m;
  frames.threads = options.threads;
  frames.frames_only = true;
  const Result<Refit> refit = RefitModel(data, model, frames);
  if (!refit) return Error{refit.error()};
  return refit->model;
}

}  // namespace

Result<Diagnosis> DiagnoseRows(const CellModel& cell, const MeasuredTable& measured,
                               const DiagnosisOptions& options) {
  const std::optional<double> cell_zero_s = cell.domain ? cell.domain->time_zero_s : std::nullopt;
  MeasuredTable on_cells_clock = measured;
  if (cell_zero_s && options.time_zero_s) {
    for (MeasuredRow& row : on_cells_clock.rows) row.t_s += *options.time_zero_s - *cell_zero_s;
  }
  if (options.order_unknown) on_cells_clock.recorded.order = false;
  const Result<Dataset> read = DatasetFrom(cell, on_cells_clock);
  if (!read) return Error{read.error()};
  const Dataset& data = *read;
  const auto interrupted = [&] { return options.interrupted && options.interrupted(); };
  const auto tell = [&](double share, const std::string& what) {
    if (options.progress) options.progress(share, what);
  };
  Diagnosis diagnosis;
  diagnosis.notes = data.notes;
  diagnosis.not_recorded = data.not_recorded;

  tell(0.02, "aligning frames");
  const Result<Model> aligned = Aligned(data, Model::Declared(data), options.threads);
  if (!aligned) return Error{aligned.error()};
  const Result<Linearisation> declared = Linearise(data, *aligned, false, options.threads);
  if (!declared) return Error{declared.error()};
  if (const auto gross = GrossError(data, *declared, options.threads)) return Error{*gross};
  const std::vector<Vec3> before = ResidualsOf(*declared);

  const std::vector<int> searched_rows = Every(data.rows(), kSearchedRows);
  const Dataset searched = Thinned(data, searched_rows);
  const Result<Identified> identified =
      Identify(searched, *aligned, options,
               [&](double share, const std::string& what) { tell(0.05 + 0.5 * share, what); });
  if (!identified) return Error{identified.error()};
  const Identified& found = *identified;

  tell(0.6, "fitting all rows");
  Refit refit = found.refit;
  std::vector<double> weights = found.weights;
  Result<Linearisation> fitted = Linearise(data, found.model, false, options.threads);
  if (!fitted) return Error{fitted.error()};
  if (searched.rows() < data.rows()) {
    const std::vector<Vec3> residuals = ResidualsOf(*fitted);
    const double scatter = std::max(found.sigma_m, RobustSigma(residuals, data.axes()));
    weights = HampelWeights(residuals, OutlierScale(residuals, scatter, data.axes()), data.axes());
    RefitOptions all;
    all.rows = Every(data.rows(), data.rows());
    all.weights = weights;
    all.sigma_m = found.sigma_m;
    all.threads = options.threads;
    all.iterations = 3;
    const Result<Refit> of_all = RefitModel(data, found.model, all);
    if (!of_all) return Error{of_all.error()};
    refit = *of_all;
    fitted = Linearise(data, refit.model, false, options.threads);
    if (!fitted) return Error{fitted.error()};
  }
  const std::vector<Vec3> after = ResidualsOf(*fitted);
  if (interrupted()) return Error{"interrupted"};

  diagnosis.sigma_m = found.sigma_m;
  const bool as_told = data.sigma_m > 0 && found.sigma_m < 1.1 * data.sigma_m;
  diagnosis.sigma_origin = as_told ? data.sigma_origin : "residual";
  diagnosis.noise_floor_m = std::sqrt(static_cast<double>(data.axes())) *
                            (data.sigma_m > 0 ? data.sigma_m : found.sigma_m);
  diagnosis.rms_before_m = Rms(before, weights);
  diagnosis.rms_after_m = Rms(after, weights);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (weights[k] < kOutlierWeight) diagnosis.outlier_rows.push_back(data.table.rows[k].line);
  }

  tell(0.65, "judging rivals");
  const FindingsContext context{searched,     *found.pool,   found.best,    refit,
                                found.ranked, found.weights, found.sigma_m, options};
  AddFindings(context, diagnosis);
  std::vector<Explanation> rivals;
  if (!found.unknown && !found.best.blocks.empty()) {
    rivals = AddRivals(context, found.model, diagnosis);
    for (Rival& rival : diagnosis.rivals) {
      if (!rival.shift_W.empty()) rival.rows = searched_rows;
    }
  }
  AddConsidered(context, found.candidates, diagnosis);
  AddDetectable(*found.pool, found.candidates, diagnosis);
  if (interrupted()) return Error{"interrupted"};

  tell(0.7, "what the rest follows");
  AddSignals(searched, data, found, options, diagnosis);
  Judge(data, found, RobustSigma(after, data.axes()), diagnosis);
  if (data.reading_sigma_m > 0 && !diagnosis.minimum_detectable_m.empty()) {
    double least_m = 1e300;
    for (const auto& [id, size_m] : diagnosis.minimum_detectable_m) {
      least_m = std::min(least_m, size_m);
    }
    diagnosis.notes.push_back(
        fmt::format("with joints read in steps of {:.3g} mrad no effect below {:.2g} mm (3-D RMS "
                    "over these rows) can be seen",
                    1e3 * data.q_step_rad, 1e3 * least_m));
  }
  if (diagnosis.verdict == Verdict::kAmbiguous) {
    tell(0.75, "where to measure next");
    AddNextPoses(*found.pool, found.model, found.weights, found.best, rivals, options, diagnosis);
  }

  tell(0.8, "what remains, shrunk");
  const std::optional<Remainder> offered =
      RemainderOf(*found.pool, found.best, found.candidates, {});
  if (interrupted()) return Error{"interrupted"};

  tell(0.85, "held-out rows");
  const HeldOutInput held_out_input{searched,
                                    found.linear,
                                    found.model,
                                    found.candidates,
                                    found.weights,
                                    found.sigma_m,
                                    found.unknown,
                                    std::max<std::size_t>(3, found.best.blocks.size() + 2),
                                    offered.has_value(),
                                    options};
  Validation validation = Validate(held_out_input);
  if (interrupted()) return Error{"interrupted"};
  const bool admitted = offered && AdmitsDiscrepancy(validation, found.weights);
  if (offered && !admitted) {
    validation = WithoutDiscrepancy(held_out_input, std::move(validation));
    diagnosis.notes.push_back(
        "a discrepancy model of what remains was tried and left out: it does not predict regions "
        "or sessions that it has not seen");
  }
  const std::optional<Remainder> remainder = admitted ? offered : std::nullopt;
  const HeldOut& held_out = validation.ways.front();
  TellHeldOut(validation, diagnosis);
  diagnosis.withheld = ReasonToWithhold(validation, HasEmpiricalTerm(diagnosis));
  if (diagnosis.findings.empty()) diagnosis.withheld.clear();

  std::vector<Vec3> corrected = after;
  if (remainder && diagnosis.withheld.empty()) {
    refit.model.effects.clear();  // as they are told and written
    for (const Finding& finding : diagnosis.findings) {
      refit.model.effects.push_back(finding.effect);
    }
    diagnosis.remainder = AddedBy(*remainder, data, refit.model);
    const Result<Model> whole =
        WithRemainder(data, refit.model, diagnosis.remainder, weights, found.sigma_m, options);
    if (!whole) return Error{whole.error()};
    refit.model = *whole;
    const Result<Linearisation> last = Linearise(data, refit.model, false, options.threads);
    if (!last) return Error{last.error()};
    corrected = ResidualsOf(*last);
    diagnosis.rms_after_m = Rms(corrected, weights);
    diagnosis.notes.push_back(fmt::format(
        "beside what is named, the model carries a shrunk remainder worth {:.0f} parameters; it "
        "corrects where there is data and explains nothing",
        remainder->held));
  }
  CheckExplanation(
      {searched, held_out, found.weights, found.sigma_m,
       static_cast<double>(found.best.columns.size()), RmsBetween(after, corrected, weights)},
      diagnosis);
  if (!diagnosis.withheld.empty()) {
    diagnosis.notes.push_back(diagnosis.withheld);
    refit.model = *aligned;
    corrected = before;
    diagnosis.rms_after_m = diagnosis.rms_before_m;
  }
  std::map<int, std::size_t> held_out_of_line;
  for (std::size_t k = 0; k < searched.table.rows.size(); ++k) {
    held_out_of_line[searched.table.rows[k].line] = k;
  }
  for (std::size_t row = 0; row < data.table.rows.size(); ++row) {
    RowTrace& trace = diagnosis.rows.emplace_back();
    trace.line = data.table.rows[row].line;
    trace.session = data.table.rows[row].session;
    trace.weight = weights[row];
    trace.outlier = weights[row] < kOutlierWeight;
    trace.p_measured = data.axes() == 3 ? data.table.rows[row].p_WT : fitted->rows[row].p_W;
    trace.before = before[row];
    trace.after = corrected[row];
    trace.fold = -1;
    if (const auto held = held_out_of_line.find(trace.line);
        held != held_out_of_line.end() && held_out.predicted[held->second]) {
      trace.fold = held_out.fold_of[held->second];
      trace.held_out_before = held_out.before[held->second];
      trace.held_out_after = held_out.after[held->second];
    }
  }
  if (!diagnosis.remainder.empty()) {
    diagnosis.remainder_parameters = remainder->held;
    diagnosis.remainder_share = UnnamedShare(diagnosis.rows, after);
  }
  AddFramesAndDomain(data, refit.model, weights, diagnosis);
  diagnosis.domain.residual_sigma_m =
      ValidatedSigma(validation, found.sigma_m, data.axes(), diagnosis.withheld.empty());
  diagnosis.domain.time_zero_s = cell_zero_s ? cell_zero_s : options.time_zero_s;
  tell(1, "done");
  return diagnosis;
}

}  // namespace plumbline
