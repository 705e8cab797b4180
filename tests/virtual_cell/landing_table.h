// Where the loaded tool landed, uncorrected and corrected: the client's result.
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
  std::optional<Vec3> declared_mm = {};  ///< corrected by the declared model, before the loop
  double uncorrected_turn_deg = 0;       ///< angle between wanted and landed orientation
  double corrected_turn_deg = 0;
  double correction_mm = 0;   ///< length of the correction, as the daemon tells it
  double uncertainty_mm = 0;  ///< likewise

  double UncorrectedError() const { return (uncorrected_mm - wanted_mm).norm(); }
  double CorrectedError() const { return (corrected_mm - wanted_mm).norm(); }
  double DeclaredError() const { return (declared_mm.value_or(corrected_mm) - wanted_mm).norm(); }
};

/// The table in the form of Park & Park (2012), Table 3: a row for each of X, Y, Z; three landings
/// where each point has its `declared_mm`, else two.
std::string LandingTable(const std::vector<Landing>& landings);
/// Adds `declared_mm`: the corrected landings of a result that LandingJson wrote before the loop.
/// @throws std::runtime_error where it is none, or lacks a point.
void AddDeclared(const std::string& json, std::vector<Landing>& landings);
std::string LandingJson(const std::vector<Landing>& landings, double require_mm);
std::string LandingCsv(const std::vector<Landing>& landings);

}  // namespace virtual_cell
