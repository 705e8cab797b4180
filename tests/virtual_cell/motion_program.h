// Robot program: taught points in work objects, and motion steps.
#pragma once

#include <string>
#include <vector>

#include "tests/virtual_cell/cell_description.h"

namespace virtual_cell {

/// A taught point: target pose of the tool point in a named work object.
struct TaughtPoint {
  int id = 0;
  std::string name;
  Motion X_BO = Motion::Identity();  ///< the work object in the base frame
  Motion X_OP = Motion::Identity();  ///< the tool point in the work object
  Vec3 tool_point_T = Vec3::Zero();  ///< the tool point in the tip frame

  Motion TipInBase() const { return X_BO * X_OP * Eigen::Translation3d(-tool_point_T); }
};

struct ProgramStep {
  enum class Kind { kHome, kMove, kJoints, kAttach, kRelease, kWait };
  Kind kind = Kind::kHome;
  std::string point;  ///< of kMove
  Joints joints;      ///< of kJoints [rad]
  double wait_s = 0;  ///< of kWait
};

struct MotionProgram {
  Joints home;
  double payload_kg = 0;
  int tool_number = 1;
  std::vector<TaughtPoint> points;
  std::vector<ProgramStep> steps;

  const TaughtPoint* Find(const std::string& name) const;
};

/// Reads a program file; the format is described in tests/virtual_cell/README.md.
/// @throws std::runtime_error with file, line and reason.
MotionProgram ReadProgramFile(const std::string& path);

/// A program for any cell: home at the middle of the joint limits, pick, two postures nearby,
/// place, home.
MotionProgram BuiltinProgram(const CellDescription& cell);

}  // namespace virtual_cell
