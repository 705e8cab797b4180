// Uncertainty budget of a measured pose, as in the GUM (JCGM 100).
#pragma once

#include <optional>
#include <vector>

#include "app/measure/accuracy/iso9283.h"

namespace plumbline::measure {

enum class Source { kInstrument, kJointReading, kRepeatability, kModel };

/// Contributions that the measured poses do not show by themselves. Standard deviations are on one
/// axis [m].
struct Contributions {
  std::optional<double> instrument_m{};  ///< declared; absent if unknown
  double joint_reading_m = 0;            ///< error at the tip due to the resolution of the joints
  /// Scatter of the residual about the best model, and its degrees of freedom.
  double residual_m = 0;
  double residual_degrees_of_freedom = 0;
  double parameters = 0;  ///< number of parameters that were fitted to the rows
  double lengths = 0;     ///< number of measured lengths that they were fitted to
};

/// One line of the budget.
struct BudgetLine {
  Source source = Source::kInstrument;
  double u_m = 0;      ///< standard uncertainty on one axis
  double freedom = 0;  ///< degrees of freedom; infinite for type B
};

struct Budget {
  std::vector<BudgetLine> lines;
  bool instrument_known = false;     ///< otherwise its line is absent
  bool repeatability_shown = false;  ///< from repeated poses; otherwise from the residual
  double combined_m = 0;             ///< root sum of squares
  double freedom = 0;                ///< effective degrees of freedom (Welch-Satterthwaite)
  double coverage_factor = 2;        ///< k
  double expanded_m() const { return coverage_factor * combined_m; }
};

/// Budget of the mean error of a pose on one axis, and thus of its pose accuracy AP_P where that is
/// large compared with the uncertainty.
///   instrument     its declared standard deviation, undivided (it may be systematic)
///   joint reading  as stated, undivided (equal in every cycle)
///   repeatability  s / sqrt(cycles), s pooled over the repeated poses; without any, the residual's
///                  scatter
///   model          s_residual sqrt(parameters / lengths): mean standard deviation of a fitted
///                  prediction at the fitted rows
/// @param cycles  of the pose, 1 or more
Budget BudgetOf(const Characteristics& characteristics, const Contributions& contributions,
                int cycles);

/// A characteristic's standard uncertainty with its expanded one.
struct Uncertainty {
  double standard_m = 0, coverage_factor = 2;
  double expanded_m() const { return coverage_factor * standard_m; }
};

/// Uncertainty of the repeatability of a pose with three or more cycles, from the number of cycles
/// alone.
Uncertainty RepeatabilityUncertainty(const PoseCharacteristics& pose);

/// Uncertainty of the distance accuracy: both poses' budgets, taken as independent.
Uncertainty DistanceUncertainty(const Characteristics& characteristics,
                                const Contributions& contributions);

/// Uncertainty of the drift: instrument and repeatability of both visits; the joint reading and the
/// model are the same in both.
Uncertainty DriftUncertainty(const Characteristics& characteristics,
                             const Contributions& contributions);

}  // namespace plumbline::measure
