// Declared cell of the simulator in SI units, without hidden effects.
#pragma once

#include <Eigen/Core>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace simulator {

inline constexpr double kDeg = std::numbers::pi / 180.0;

/// One row of the Denavit-Hartenberg table and its link.
struct Joint {
  bool prismatic = false;  ///< its positions and limits are in metres
  double a_m = 0.0;
  double alpha_rad = 0.0;
  double d_m = 0.0;
  double offset_rad = 0.0;
  double sign = 1.0;
  double min_rad = -3.0;
  double max_rad = 3.0;
  double mass_kg = 0.0;
  bool mass_known = false;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();  ///< in the link's DH frame
  std::optional<double> compliance_rad_per_Nm;
};

/// A straight square tube along +z of the flange, or a rigid tip.
struct Tool {
  bool rigid = false;
  Eigen::Vector3d tcp_m = Eigen::Vector3d::Zero();  ///< of a rigid tool
  double length_m = 0.0;
  double side_m = 0.0;
  double wall_m = 0.0;
  double youngs_modulus_Pa = 0.0;
  double poisson_ratio = 0.0;
  double density_kg_m3 = 0.0;
  double mount_mass_kg = 0.0;

  double AreaM2() const;
  double SecondMomentM4() const;
  double BodyMassKg() const;  ///< without the mount
};

struct Cell {
  std::string name;
  bool proximal = false;  ///< "mdh"
  Eigen::Vector3d gravity_m_s2 = {0.0, 0.0, -9.80665};
  Eigen::Vector3d base_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d base_rpy_rad = Eigen::Vector3d::Zero();
  std::vector<Joint> joints;
  Tool tool;
  std::optional<Eigen::Vector3d> payload_cog_m;  ///< in the flange frame
  double sigma_m = 0.0;
  double sigma_rad = 0.0;  ///< of a measured orientation on one axis; 0: not measured
  double reference_temperature_C = 22.0;
  struct Camera {
    Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();
  };
  std::optional<Camera> camera;             ///< measuring camera; its optical axis is z
  std::optional<Eigen::Vector3d> anchor_m;  ///< origin of measured ranges
  bool unaligned = false;
  bool tool_unknown = false;
  std::vector<double> payloads_kg = {0.0};  ///< payloads used by the design; not in the file
};

/// @throws std::runtime_error naming the missing or unsupported key
Cell ReadCell(const std::string& path);

/// Writes the cell as cell.toml, in millimetres, degrees and kilograms.
void WriteCell(const Cell& cell, const std::string& path);

/// A built-in cell by robot name: kr210, ur10, arm6 (a fictitious arm in the proximal convention)
/// or lift (a lift, an extending axis and a wrist of three joints).
/// @throws std::runtime_error for any other name
Cell ReadyCell(const std::string& robot);

/// A camera beside the arm at twice its length, looking slightly down on it.
Cell::Camera CameraBeside(const Cell& cell);

/// Position of a wire drum or distance meter: beside the arm, at its reach.
Eigen::Vector3d AnchorBeside(const Cell& cell);

std::vector<std::string> ReadyRobots();

}  // namespace simulator
