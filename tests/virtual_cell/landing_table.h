// Result of the PLC client: landings of the loaded tool, uncorrected and corrected.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/virtual_cell/rigid_motion.h"

namespace virtual_cell {

/// One assembly point. Positions are in the point's work object [mm].
struct Landing {
  int id = 0;
  std::string name;
  Vec3 wanted_mm = Vec3::Zero();
  Vec3 uncorrected_mm = Vec3::Zero();
  Vec3 corrected_mm = Vec3::Zero();
  std::optional<Vec3> declared_mm = {};  ///< corrected by the declared model, before diagnosis
  double uncorrected_turn_deg = 0;       ///< angle between wanted and landed orientation
  double corrected_turn_deg = 0;
  double correction_mm = 0;   ///< magnitude of the correction reported by the daemon
  double uncertainty_mm = 0;  ///< 95 % radius reported by the daemon
  int basis = 0;              ///< of that radius: 0 unknown, 1 assumed, 2 propagated, 3 measured
  bool extrapolated = false;  ///< outside the range that the model was fitted to

  double UncorrectedError() const { return (uncorrected_mm - wanted_mm).norm(); }
  double CorrectedError() const { return (corrected_mm - wanted_mm).norm(); }
  double DeclaredError() const { return (declared_mm.value_or(corrected_mm) - wanted_mm).norm(); }
};

/// The table in the form of Park & Park (2012), Table 3: a row for each of X, Y, Z; three landings
/// if each point has its `declared_mm`, otherwise two.
std::string LandingTable(const std::vector<Landing>& landings);
/// One line for each point: its error, and the radius with its basis.
std::string RadiusLines(const std::vector<Landing>& landings);
/// Whether a PLC that accepts no assumed radius (packaging/examples/plc/pl_point.st) would use
/// every point, and the landings are plausible: measured, in the fitted range, error below 1.64
/// times the 95 % radius, as 99.99 % of normal errors are (4.6 standard deviations, not 2.8).
bool RadiiHold(const std::vector<Landing>& landings);
/// Adds `declared_mm`: the corrected landings of an earlier result written by LandingJson.
/// @throws std::runtime_error if the JSON is invalid or lacks a point
void AddDeclared(const std::string& json, std::vector<Landing>& landings);
std::string LandingJson(const std::vector<Landing>& landings, double require_mm);
std::string LandingCsv(const std::vector<Landing>& landings);

}  // namespace virtual_cell
