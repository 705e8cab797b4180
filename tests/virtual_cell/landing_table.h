// Where the loaded tool landed, uncorrected and corrected: the client's result.
#pragma once

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
  double uncorrected_turn_deg = 0;  ///< angle between wanted and landed orientation
  double corrected_turn_deg = 0;
  double correction_mm = 0;   ///< length of the correction, as the daemon tells it
  double uncertainty_mm = 0;  ///< likewise

  double UncorrectedError() const { return (uncorrected_mm - wanted_mm).norm(); }
  double CorrectedError() const { return (corrected_mm - wanted_mm).norm(); }
};

/// The table in the form of Park & Park (2012), Table 3: a row for each of X, Y, Z.
std::string LandingTable(const std::vector<Landing>& landings);
std::string LandingJson(const std::vector<Landing>& landings, double require_mm);
std::string LandingCsv(const std::vector<Landing>& landings);

}  // namespace virtual_cell
