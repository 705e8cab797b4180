// Description of the virtual world: the required fields of a cell file, in SI units.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "tests/virtual_cell/rigid_motion.h"

namespace virtual_cell {

/// A joint and its link, from the Denavit-Hartenberg row in the cell file.
struct JointDescription {
  bool prismatic = false;
  double a_m = 0, alpha_rad = 0, d_m = 0, offset_rad = 0;
  double sign = 1;
  double min = -std::numeric_limits<double>::infinity();  ///< [rad] or [m]
  double max = std::numeric_limits<double>::infinity();
  double link_mass_kg = 0;
  Vec3 link_com_m = Vec3::Zero();
  double compliance = 0;  ///< [rad/(N m)] or [m/N]
};

/// A segment of the tool with constant section; the flange side comes first.
struct RodSegment {
  double length_m = 0;
  double area_m2 = 0;
  double EI_x = 0, EI_y = 0;  ///< bending stiffness about x and about y [N m^2]
  double GJ = 0;              ///< torsion [N m^2]
  double GA = 0;              ///< shear, without the section's factor [N]
  double EA = 0;              ///< extension [N]
  double weight_kg_m = 0;     ///< mass per length
};

struct CellDescription {
  std::string name;
  bool proximal_dh = false;  ///< "mdh": the joint rotates about z of its own frame
  Vec3 gravity_W = Vec3(0, 0, -9.80665);
  Motion X_WB = Motion::Identity();
  std::vector<JointDescription> joints;

  bool rigid_tool = true;
  bool sheared_tool = false;      ///< "timoshenko"
  double shear_factor = 5.0 / 6;  ///< of the section, used where sheared
  std::vector<RodSegment> rod;    ///< empty for a rigid tool
  Vec3 tip_F = Vec3::Zero();      ///< nominal tip in the flange frame
  double mount_mass_kg = 0;       ///< a rigid bracket on the flange, centre at mid length
  Vec3 payload_cog_F = Vec3::Zero();
  double reference_temperature_C = 22;

  int size() const { return static_cast<int>(joints.size()); }
};

/// Reads a cell file (schema 1). @throws std::runtime_error with file, line and reason.
CellDescription ReadCellFile(const std::string& path);

}  // namespace virtual_cell
