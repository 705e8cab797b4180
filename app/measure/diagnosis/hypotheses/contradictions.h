// Detection of references that contradict the rest of the data.
#pragma once

#include <functional>
#include <memory>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/search/identify.h"

namespace plumbline::measure {

/// Result of testing the references.
struct TestedReferences {
  References references;
  /// RMS of declared minus predicted from all other data, with the effects and with none [m].
  double with_effects_m = 0, declared_m = 0;
  double largest_m = 0;  ///< of the contradicting references, with the effects [m]

  /// True if a correction is useful although references contradict it: the references agree with it
  /// to half the error that they have with the declared arm, and the largest contradiction, which
  /// may mislead the correction by as much, is below half the error that the rows have with the
  /// declared arm. Both halves are judgements.
  /// @param rms_before_m  error of the rows under the declared arm
  bool CorrectionIsUseful(double rms_before_m) const;
};

/// Tests each reference by deletion residuals: with e the whitened residual of its equation and h
/// the leverage of the equation in the fit of frames, artefact positions and selected effects,
///   z = e / sqrt(1 - h),   declared - predicted from all other data = sd e / (1 - h)
///   [D. A. Belsley, E. Kuh, R. E. Welsch, Regression Diagnostics, Wiley 1980, section 2.1]
/// A reference contradicts if |z| of one of its equations exceeds the normal quantile of 0.1 %,
/// divided by the number of tested equations. A position declared as exact (sd_mm = 0), which the
/// fit does not change, is tested as if it were known to 0.01 mm. Not tested are equations that
/// nothing else determines (1 - h near 0), and directions.
/// @return  an error if a deflected posture does not converge
Result<TestedReferences> TestReferences(const Identified& found);

/// The check `contradictions` of the whole answer. If a reference contradicts, each finding is
/// doubtful, and the correction is withheld unless it is useful nevertheless (CorrectionIsUseful);
/// without findings the answer is `unknown`.
Opinion OpinionOnContradictions(const TestedReferences& tested, const Diagnosis& diagnosis);

/// A diagnosis whose model is identified and tested against the references, but not validated yet.
class Attempt {
 public:
  virtual ~Attempt() = default;
  /// The verdict before validation, and the result of the test.
  virtual const Diagnosis& so_far() const = 0;
  /// Validates the model. May be called once.
  virtual Result<Diagnosis> Finish() = 0;
};

/// Diagnoses with `attempt`, and sets references aside that contradict, the largest |z| first, as
/// long as they are at most a quarter of all references. If more contradict, or if a residual
/// remains `unknown` without them, the model may be at fault instead, so that all are kept and
/// named in a note; also if an attempt without some of them fails. Only the diagnosis that is
/// returned is validated.
Result<Diagnosis> SetAsideContradictions(
    const model::CellModel& cell, const DiagnosisOptions& options,
    const std::function<Result<std::unique_ptr<Attempt>>(const model::CellModel&)>& attempt);

}  // namespace plumbline::measure
