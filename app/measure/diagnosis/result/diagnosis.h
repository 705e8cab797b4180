// Result and options of the diagnosis.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/data/indices.h"
#include "app/measure/diagnosis/data/observations.h"
#include "app/measure/table/csv.h"
#include "firmware-like/effects/written.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

enum class Verdict { kNoEffect, kExplained, kAmbiguous, kUnknown };

/// The verdict as written in files: "no_effect", "explained", "ambiguous", "unknown".
const char* Describe(Verdict verdict);

/// An effect identified from the data.
struct Finding {
  effects::ActiveEffect effect;  ///< values in SI
  Eigen::MatrixXd covariance;    ///< of its values, SI; empty if not identifiable
  /// p-value of removing the effect: chi2 tail with one degree of freedom per parameter, times the
  /// number of effects, shapes and choices of joints searched. The selection of the other effects
  /// from the same rows is not corrected for.
  double p_value = 1;
  /// RMS displacement of the measured point at the rows [m]: by the effect, and by each of its
  /// values alone, 0 for a shape (findings.h); empty if not computed.
  double tip_rms_m = 0;
  std::vector<double> tip_rms_of_each_m{};
  double share_of_residual = 0;  ///< increase of chi2 on removal over chi2 without any effect
  std::string implausible;       ///< empty, or why the value is implausible for a healthy machine
  /// Largest ratio of a value to its plausible bound; infinite for a physically impossible sign; 0
  /// if all values are plausible.
  double implausible_times = 0;
  std::string
      origin{};  ///< where it is from, if not from the measured rows: SiblingEvidence::source
};

/// Another explanation that these data cannot rule out.
struct Rival {
  std::string instead_of;  ///< id of the finding
  std::string id;
  std::string instead_of_word, word;  ///< variants, if any: two variants of one id can be rivals
  std::string only;                   ///< the rows in which it acts: "session 2"; empty: in all
  std::string along;  ///< the signal of a curve without a cause; empty: `id` is an effect
  std::vector<std::string> scope;
  /// Cycles per turn, if only a line of the finding is exchanged.
  std::optional<double> instead_of_cycles, cycles;
  double signal_left =
      0;  ///< share of the finding's signal that the refitted rival cannot reproduce
  double evidence_gap = 0;     ///< score of the rival minus score of the answer; 16 is 4 sigma
  std::vector<Vec3> shift_W;   ///< the rival's prediction minus the answer's [m]
  std::vector<RowIndex> rows;  ///< of each shift, into Diagnosis::rows (a subset)
};

/// A candidate effect and why it was selected or rejected.
struct CandidateOutcome {
  std::string id;
  std::vector<std::string> scope;  ///< joints selected when fitted alone
  int parameters = 0;
  double chi2_drop = 0;     ///< when fitted alone, frames projected out
  double signal_share = 0;  ///< chi2_drop over chi2 without any effect
  double evidence_gap = 0;  ///< best score of an explanation with it, minus the answer's
  bool gap_is_lower_bound =
      false;  ///< no listed explanation has it: `evidence_gap` is a lower bound
  bool taken = false;
  std::string reason;  ///< "selected", or why it was rejected or not considered
};

/// A measured row with its residuals before and after correction.
struct RowTrace {
  int line = 0;  ///< of the file, the header being line 1
  std::string session;
  ObservationKind kind = ObservationKind::kPosition;
  ClusterIndex pose{};   ///< replicates of one pose share it: same joints, session and payload
  int fold = 0;          ///< block of time it was held out with; -1: never held out
  double weight = 1;     ///< of the robust fit
  bool outlier = false;  ///< weight below kOutlierWeight; excluded from error figures and plots
  /// In W [m]; for a row without a measured position (a range, an artefact), the predicted tip.
  Vec3 p_measured = Vec3::Zero();
  Vec3 before = Vec3::Zero();  ///< measured minus declared model, frames aligned [m]
  Vec3 after = Vec3::Zero();   ///< measured minus corrected model [m]
  /// Like `before` and `after`, with frames and model estimated without this row's fold
  /// (held_out.h); absent if the row was not held out.
  std::optional<Vec3> held_out_before, held_out_after;
};

/// A recorded signal over the rows, and whether the residual follows it.
struct SignalTrace {
  std::string name;       ///< column name, with its unit
  PerRow<double> values;  ///< of Diagnosis::rows
  double p_value = 1;     ///< of the residual following it (permutation test over all signals)
  double share = 0;       ///< share of the residual sum of squares that it explains
};

/// A line in the spectrum of the residual along a joint angle.
struct SpectralLine {
  int joint = 0;
  double cycles_per_turn = 0;
  double amplitude_rad = 0;  ///< in the residual after correction
};

/// A measurement that would separate rivals.
struct NextPose {
  model::JointVector q;  ///< [rad] or [m]
  double payload_kg = 0;
  double separation_m = 0;  ///< largest distance between the explanations' predictions
  std::optional<int> tool_number{}, payload_item{};
  model::JointVector via_q{};      ///< passed on the way to set the side of approach; empty: none
  double wait_s = 0;               ///< before the move to the pose
  model::JointVector qd{}, qdd{};  ///< at the moment of measurement; empty if irrelevant
};

/// How far apart the answer and its rivals are at a pose that was not measured: a random one within
/// the measured range, or one beside a measured pose.
struct RivalSeparation {
  model::JointVector q;   ///< [rad] or [m]
  double distance_m = 0;  ///< largest of all rivals, each refitted to the rows
};

/// An effect, parameters of it, or another quantity that the rows do not determine; it is not
/// estimated.
struct NotObservable {
  std::string id;                       ///< of an effect; or "scale"
  std::vector<std::string> scope;       ///< joints; empty if it has none
  std::vector<std::string> parameters;  ///< names in files; empty: all of it
  std::string reason;
};

/// Errors of the rows of one kind of observation [m]: 3-D for positions and points, along the
/// measured direction otherwise.
struct KindError {
  std::string kind;  ///< "position", "range", "point", "sphere", "plane", "gauge"
  int rows = 0;      ///< that are not outliers
  double before_m = 0, after_m = 0;
  std::optional<double> before_held_out_m, after_held_out_m;  ///< by blocks of time
  double noise_floor_m = 0;
};

struct HeldOutError {
  std::string by;                            ///< "blocks of time", "sessions", ..
  double before_m = 0, after_m = 0;          ///< 3-D RMS
  double after_low_m = 0, after_high_m = 0;  ///< 95 %, bootstrap over clusters
};

/// Result of an acceptance check.
struct ExplanationCheck {
  std::string name;    ///< "held_out_error", "p_value", "selection_frequency", ..
  std::string effect;  ///< id of the checked finding; empty: the whole answer
  bool passed = false;
  double figure = 0;     ///< in the unit stated in `sentence`
  double limit = 0;      ///< of `figure`
  std::string sentence;  ///< the comparison in words
};

/// What measured arms of the same model contributed (app/measure/siblings).
struct SiblingEvidence {
  std::string source;       ///< "37 arms of KR 210 R2700-2, 2026-11-30"; empty: none could be used
  std::string model, date;  ///< of a prior from the plant; empty: the arms were given as folders
  std::vector<std::string> arms;      ///< their names or folders
  std::vector<std::string> left_out;  ///< because they differ from the others
  bool used = false;                  ///< the answer refers to the declared cell plus `applied`
  std::string reason;                 ///< why they were used or not, one sentence
  std::vector<Finding> common;        ///< mean over the arms; covariance: spread of a further arm
  std::vector<effects::ActiveEffect> applied;  ///< adjusted to the rows, with covariance
  double declared_m = 0;   ///< RMS error of the rows under the declared cell; 0: not computed
  double predicted_m = 0;  ///< with the siblings' mean; only free frames are fitted
  double held_out_without_m = 0;  ///< held-out error of the answer without siblings; 0: none
  double held_out_with_m = 0;     ///< and with them
};

/// A finding that failed a check.
struct Doubt {
  std::string id;
  std::vector<std::string> scope;
  std::string reason;
};

/// A reference (references.h) that the rest of the data contradicts.
struct Contradiction {
  Reference reference;
  double z = 0;          ///< deletion residual in its standard deviations
  std::string sentence;  ///< declared and predicted value
};

/// Declared distances and positions (references.h), as the data test them.
struct References {
  int tested = 0;
  std::vector<Contradiction> contradicting;  ///< in use, the largest first
  std::vector<Contradiction> set_aside;      ///< not used
};

/// Rows on one side of a value of a recorded signal, or with one name.
struct RowCondition {
  std::string column;
  std::string name;   ///< of the artefact, camera .., if `column` is one of these
  double limit = 0;   ///< in file units
  bool above = true;  ///< the rows from `limit` up, otherwise those from `limit` down
};

/// Rows under a condition that the model fits worse than the others.
struct Misfit {
  RowCondition condition;
  bool larger_residuals = false;  ///< otherwise they are rejected
  /// Whether nothing else explains them. If they were measured in one or two stretches, a
  /// disturbance at that time would do the same.
  bool certain = true;
  /// Whether points under the condition are outside the domain: if it can be tested on them, and
  /// does not hold for more than half of the rows.
  bool outside_domain = true;
};

struct Diagnosis {
  Verdict verdict = Verdict::kNoEffect;
  std::vector<Finding> findings;
  std::vector<Finding>
      discrepancy;  ///< discrepancy model, written to the model only (discrepancy.h)
  double discrepancy_parameters = 0;       ///< its effective number of parameters; 0: no such model
  double discrepancy_share = 0;            ///< its share of the correction's sum of squares
  std::vector<std::string> finding_names;  ///< parameters' file names, as in `correlation`
  Eigen::MatrixXd correlation;             ///< of all parameters of all findings
  std::vector<Rival> rivals;
  std::vector<ExplanationCheck> checks;
  std::vector<Doubt> doubts;
  References references;
  std::string withheld;              ///< empty, or why the corrected model carries no correction
  std::vector<std::string> drivers;  ///< columns that the unknown cause follows
  /// Alternative drivers of an empirical term; each is among the rivals.
  std::vector<std::vector<std::string>> rival_drivers;
  std::vector<NextPose> next_poses;
  std::vector<RivalSeparation> rival_separations;  ///< empty without rivals
  bool next_poses_separate_all = false;            ///< from the answer and from each other
  bool next_poses_searched = false;  ///< if none is proposed, none separates by the noise
  std::map<std::string, double> minimum_detectable_m;  ///< 3-D RMS over the rows, by id
  /// Of the kind of observation with the most rows.
  double rms_before_m = 0, rms_after_m = 0;
  std::vector<NotObservable> not_observable;
  std::vector<KindError> rms_by_kind;  ///< the kind with the most rows first
  double noise_floor_m = 0;            ///< 3-D: declared sigma times sqrt(lengths per row)
  double sigma_m = 0;                  ///< one axis, as used
  /// Median noise that the rows state in the column sigma_mm, one axis; it replaces the declared
  /// one. Absent if no row states its own.
  std::optional<double> row_sigma_m;
  /// Error at the tip due to the declared resolution of the joint readings: standard deviation on
  /// one axis, mean over the rows.
  double joint_reading_sigma_m = 0;
  std::optional<Misfit> misfit;
  /// The residual is far above the declared noise and no repeats confirm that noise. The noise in
  /// use (3-D) then replaces `noise_floor_m`.
  bool declared_noise_too_small = false;
  double noise_in_use_m = 0;
  std::string sigma_origin;        ///< "declared", "repeats", "residual"
  std::string noise_floor_origin;  ///< likewise
  HeldOutError held_out;           ///< by blocks of time
  std::string held_out_by;         ///< "blocks of time"; empty if no row could be held out
  std::vector<HeldOutError> held_out_by_all;  ///< by blocks of time, regions and sessions
  std::vector<int> outlier_rows;              ///< file lines
  std::vector<CandidateOutcome> considered;
  std::vector<SignalTrace> signals;
  std::vector<SpectralLine> spectrum;
  PerRow<RowTrace> rows;
  std::vector<std::string> notes;              ///< remarks to the user, one sentence each
  std::vector<std::string> not_recorded;       ///< missing signals and the effects they would show
  std::vector<model::SessionFrames> sessions;  ///< estimated frames, if the cell leaves them free
  model::Domain domain;                        ///< of the rows used
  std::optional<SiblingEvidence> siblings;     ///< absent if there are none
};

/// Options of a diagnosis.
struct DiagnosisOptions {
  int threads = 2;
  int bootstrap = 200;
  int next_poses = 6;
  /// UTC at t_s = 0 of the rows, in seconds since 1970; absent if it is as declared in the cell, or
  /// unknown.
  std::optional<double> time_zero_s = std::nullopt;
  /// The robot made unrecorded moves between the rows (probes of a running cell).
  bool order_unknown = false;
  /// Progress callback: completed share 0..1 and current activity. May be empty.
  std::function<void(double, const std::string&)> progress;
  /// Polled during the work; returning true aborts it with the error "interrupted". May be empty.
  std::function<bool()> interrupted;
};

}  // namespace plumbline::measure
