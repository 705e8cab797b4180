// What a diagnosis found: the answer that is written, drawn and applied.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/diagnosis/indices.h"
#include "app/table/csv.h"
#include "firmware-like/effects/written.h"
#include "firmware-like/result.h"

namespace plumbline {

enum class Verdict { kNoEffect, kExplained, kAmbiguous, kUnknown };

/// The word of the file formats: "no_effect", "explained", "ambiguous", "unknown".
const char* Describe(Verdict verdict);

/// An effect that the data show.
struct Finding {
  ActiveEffect effect;         ///< values in SI
  Eigen::MatrixXd covariance;  ///< of its values, SI; empty: the rows do not hold them
  /// Of dropping it: the tail of chi2 at the parameters kept, times the effects, shapes and choices
  /// of joints looked at. Not of the effects beside it, which were chosen from the same rows.
  double p_value = 1;
  double share_of_residual = 0;  ///< of the sum of squares before that leaving it out brings back
  std::string implausible;       ///< empty, or why a sound machine does not show this value
  /// How many times a value lies beyond what a sound machine shows; infinite where its sign is one
  /// that no machine shows; 0: it does not.
  double implausible_times = 0;
};

/// Another explanation that these data cannot rule out.
struct Rival {
  std::string instead_of;  ///< id of the finding
  std::string id;
  std::string instead_of_word, word;  ///< where they have one: two words of one id are rivals, too
  std::vector<std::string> scope;
  double signal_left = 0;  ///< share of the finding's signal that the refitted rival cannot imitate
  double evidence_gap = 0;     ///< score of the rival minus score of the answer; 16 is 4 sigma
  std::vector<Vec3> shift_W;   ///< the rival's prediction minus the answer's [m]
  std::vector<RowIndex> rows;  ///< of each shift, in Diagnosis::rows (not every row is asked)
};

/// A candidate and what became of it.
struct Considered {
  std::string id;
  std::vector<std::string> scope;  ///< joints that would be kept, alone
  int parameters = 0;
  double chi2_drop = 0;  ///< alone, after the frames
  double signal_share =
      0;  ///< of the residual's sum of squares it explains alone, after the frames
  double evidence_gap = 0;  ///< score of the best explanation with it, minus the best's
  bool beyond_gap = false;  ///< none was listed with it: the gap is larger than this
  bool taken = false;
  std::string reason;  ///< "taken", or why it was refused or could not be offered
};

/// One measured row, before and after.
struct RowTrace {
  int line = 0;  ///< of the file, the header being line 1
  std::string session;
  int fold = 0;          ///< held-out block it belongs to; -1: it was not predicted without itself
  double weight = 1;     ///< of the robust fit
  bool outlier = false;  ///< its weight is too small: errors and pictures leave it out
  Vec3 p_measured =
      Vec3::Zero();            ///< in W [m]; of a range, the predicted point moved along the ray
  Vec3 before = Vec3::Zero();  ///< measured minus declared model, frames aligned [m]
  Vec3 after = Vec3::Zero();   ///< measured minus corrected model [m]
  /// With frames fitted without this row's block; absent where it was not predicted.
  std::optional<Vec3> held_out_before;
  std::optional<Vec3>
      held_out_after;  ///< likewise, model chosen and fitted without it (held_out.h)
};

/// A recorded signal over the rows, for drawing and for naming drivers.
struct SignalTrace {
  std::string name;       ///< column name, with its unit
  PerRow<double> values;  ///< of Diagnosis::rows
  double p_value = 1;  ///< that the residual after follows it (permutation, all signals considered)
  double share = 0;    ///< of the remaining sum of squares that it explains
};

/// A line of the spectral search.
struct SpectralLine {
  int joint = 0;
  double cycles_per_turn = 0;
  double amplitude_rad = 0;  ///< at the best phase, in the residual after
};

/// A measurement that would separate rivals.
struct NextPose {
  JointVector q;  ///< [rad] or [m]
  double payload_kg = 0;
  double separation_m = 0;  ///< how far the rivals' predictions differ there
  JointVector via_q{};      ///< passed on the way, so that joints come from a side; empty: directly
  double wait_s = 0;        ///< before the move there
  JointVector qd{}, qdd{};  ///< at the moment of measurement; empty where speed is no matter
};

struct HeldOutError {
  std::string by;                            ///< "blocks of time", "sessions", ..
  double before_m = 0, after_m = 0;          ///< 3-D RMS
  double after_low_m = 0, after_high_m = 0;  ///< 95 %, bootstrap over clusters
};

/// A test that an explanation passes before it is called one.
struct ExplanationCheck {
  std::string name;    ///< "held_out_error", "p_value", "selection_frequency", ..
  std::string effect;  ///< id of the finding judged; empty: the whole answer
  bool passed = false;
  double figure = 0;     ///< in the unit that `sentence` names
  double limit = 0;      ///< of `figure`
  std::string sentence;  ///< what was compared with what
};

/// A named effect that failed a check.
struct Doubt {
  std::string id;
  std::vector<std::string> scope;
  std::string reason;
};

struct Diagnosis {
  Verdict verdict = Verdict::kNoEffect;
  std::vector<Finding> findings;
  std::vector<Finding>
      discrepancy;  ///< unnamed, shrunk: added to the model only (see discrepancy.h)
  double discrepancy_parameters = 0;       ///< that the data hold of it; 0: there is none
  double discrepancy_share = 0;            ///< of the correction's sum of squares over the rows
  std::vector<std::string> finding_names;  ///< parameters' file names, as in `correlation`
  Eigen::MatrixXd correlation;             ///< of all parameters of all findings
  std::vector<Rival> rivals;
  std::vector<ExplanationCheck> checks;
  std::vector<Doubt> doubts;
  std::string withheld;              ///< empty, or why the corrected model carries no correction
  std::vector<std::string> drivers;  ///< columns
  /// Drivers that an empirical term may follow as well; each is among the rivals.
  std::vector<std::vector<std::string>> rival_drivers;
  std::vector<NextPose> next_poses;
  bool next_poses_separate_all =
      false;  ///< every rival would be ruled out, or shown to be the truth
  std::map<std::string, double>
      minimum_detectable_m;  ///< 3-D RMS over the rows, by id; detectable.h
  double rms_before_m = 0, rms_after_m = 0;
  double noise_floor_m = 0;  ///< 3-D: sigma times the root of the lengths that a row measures
  double sigma_m = 0;        ///< one axis, as used
  /// What remains is far above the declared noise, and no repeats bear that noise out: then it is
  /// too small, and 3-D `noise_in_use_m` goes before `noise_floor_m`.
  bool declared_noise_too_small = false;
  double noise_in_use_m = 0;
  std::string sigma_origin;                   ///< "declared", "repeats", "residual"
  std::string noise_floor_origin;             ///< likewise
  HeldOutError held_out;                      ///< by blocks of time
  std::string held_out_by;                    ///< "blocks of time"; empty: no row could be held out
  std::vector<HeldOutError> held_out_by_all;  ///< by blocks of time, regions and sessions
  std::vector<int> outlier_rows;              ///< file lines
  std::vector<Considered> considered;
  std::vector<SignalTrace> signals;
  std::vector<SpectralLine> spectrum;
  PerRow<RowTrace> rows;
  std::vector<std::string> notes;         ///< what an engineer should know, one sentence each
  std::vector<std::string> not_recorded;  ///< signals that were not recorded, and what they hide
  std::vector<SessionFrames> sessions;    ///< frames estimated, where unaligned or unknown
  Domain domain;                          ///< of the rows used
};

/// What may be asked of a diagnosis beside the data.
struct DiagnosisOptions {
  int threads = 2;
  int bootstrap = 200;
  int next_poses = 6;
  /// UTC where the rows' t_s is 0, in seconds since 1970; absent: as the cell has it, or not known.
  std::optional<double> time_zero_s = std::nullopt;
  /// The robot made moves between the rows that are not recorded (probes of a running cell).
  bool order_unknown = false;
  /// Told of progress: a share of 0..1 and what is being done. May be empty.
  std::function<void(double, const std::string&)> progress;
  /// Asked now and then; true ends the work early (Diagnose returns an error "interrupted").
  std::function<bool()> interrupted;
};

/// Finds what the declared cell lacks. Deterministic: the same input gives the same answer. Where
/// some rows lack a signal that others have (the last move after a lost line, velocities), the rows
/// that lack nothing are asked first; the others take part too unless the answer follows that
/// signal (partial_rows.h).
/// @return  an error where the data cannot be used at all, with what to do about it; the caller
///          names the file
Result<Diagnosis> Diagnose(const CellModel& cell, MeasuredTable measured,
                           const DiagnosisOptions& options);

/// The same of all rows at once: an effect adds nothing where the row lacks its signal.
Result<Diagnosis> DiagnoseRows(const CellModel& cell, MeasuredTable measured,
                               const DiagnosisOptions& options);

}  // namespace plumbline
