// First page of the report: a measurement certificate that fits one A4 page.
#pragma once

#include <string>

#include "app/measure/report/achieved_accuracy.h"
#include "app/measure/report/figures_certificate.h"
#include "app/measure/report/report.h"

namespace plumbline::measure {

/// Input of the first page; the figures have already been drawn.
struct CertificateInput {
  const Diagnosis& diagnosis;
  const model::CellModel& cell;
  const ReportSource& source;
  const AchievedAccuracy& achieved;
  const CertificateFigure &points, &deciding;
  const std::string& figure_fault;  ///< why there are no figures; empty if there are
};

/// Upper estimate of the height of the printed page without its figures, but with their captions
/// [mm].
double CertificateTextHeight_mm(const CertificateInput& input);

/// The page as HTML. Its texts are limited in number and length so that it stays one page; what is
/// left out is in the appendix.
std::string CertificatePage(const CertificateInput& input);

/// Overall statement of conformity at the measured poses.
struct Conformity {
  /// kWouldConform: only as the corrected model predicts the measured poses.
  enum class Outcome { kConforms, kWouldConform, kDoesNotConform, kNotDecided };
  Outcome outcome = Outcome::kNotDecided;
  std::string sentence;  ///< plain text
};

/// Conforms only if every assessed pose does (ISO 14253-1) as measured and after correction, there
/// are at least five, the instrument's uncertainty is declared, the residual does not refute it,
/// and no row was rejected. Would conform if the poses do so only as the corrected model predicts
/// them: the robot was not measured with it. Does not conform if at least one pose does not, after
/// correction if there is one.
Conformity ConformityOf(const AchievedAccuracy& achieved, double tolerance_m);

/// Characteristics of ISO 9283 before and after correction, with expanded uncertainties.
std::string CharacteristicsTable(const AchievedAccuracy& achieved);

/// Uncertainty budget of the pose with the fewest cycles.
std::string BudgetTable(const AchievedAccuracy& achieved, const Diagnosis& diagnosis);

/// Each pose with its cycles, errors before and after, expanded uncertainty and decision.
std::string PosesTable(const AchievedAccuracy& achieved, std::optional<double> tolerance_m);

}  // namespace plumbline::measure
