#include "tests/virtual_cell/motion_program.h"

#include <algorithm>
#include <cmath>

#include "tests/virtual_cell/toml_fields.h"

namespace virtual_cell {
namespace {

/// The pose of the [[frame]] named in `fields`; the base if none is named.
Motion FrameOf(const TomlFields& file, const TomlFields& fields) {
  if (!fields.Has("frame")) return Motion::Identity();
  for (const TomlFields& frame : file.Tables("frame")) {
    if (frame.Text("name") == fields.Text("frame")) {
      return MotionFromXyzMmRpyDeg(frame.Vector("xyz_mm"), frame.Vector("rpy_deg", Vec3::Zero()));
    }
  }
  fields.Fail("frame", "no [[frame]] has this name");
}

TaughtPoint ReadPoint(const TomlFields& file, const TomlFields& fields) {
  TaughtPoint point;
  point.id = static_cast<int>(fields.Number("id"));
  point.name = fields.Text("name");
  point.X_BO = FrameOf(file, fields);
  point.X_OP =
      MotionFromXyzMmRpyDeg(fields.Vector("xyz_mm"), fields.Vector("rpy_deg", Vec3::Zero()));
  point.tool_point_T = fields.Vector("tool_point_mm", Vec3::Zero()) * 1e-3;
  return point;
}

ProgramStep ReadStep(const MotionProgram& program, const TomlFields& fields) {
  const std::string what = fields.Text("do");
  ProgramStep step;
  if (what == "home") {
    step.kind = ProgramStep::Kind::kHome;
  } else if (what == "move") {
    step.kind = ProgramStep::Kind::kMove;
    step.point = fields.Text("point");
    if (program.Find(step.point) == nullptr) fields.Fail("point", "no [[point]] has this name");
  } else if (what == "attach") {
    step.kind = ProgramStep::Kind::kAttach;
  } else if (what == "release") {
    step.kind = ProgramStep::Kind::kRelease;
  } else if (what == "wait") {
    step.kind = ProgramStep::Kind::kWait;
    step.wait_s = fields.Number("s");
  } else {
    fields.Fail("do", "one of home, move, attach, release, wait is needed");
  }
  return step;
}

}  // namespace

const TaughtPoint* MotionProgram::Find(const std::string& name) const {
  const auto found = std::find_if(points.begin(), points.end(),
                                  [&](const TaughtPoint& point) { return point.name == name; });
  return found == points.end() ? nullptr : &*found;
}

MotionProgram ReadProgramFile(const std::string& path) {
  const toml::table root = ParseTomlFile(path);
  const TomlFields file(root, path);
  MotionProgram program;
  const std::vector<double> home_deg = file.Numbers("home_deg");
  program.home.resize(static_cast<Eigen::Index>(home_deg.size()));
  for (std::size_t i = 0; i < home_deg.size(); ++i) {
    program.home[static_cast<Eigen::Index>(i)] = RadFromDeg(home_deg[i]);
  }
  program.payload_kg = file.Number("payload_kg", 0);
  program.tool_number = static_cast<int>(file.Number("tool_number", 1));
  for (const TomlFields& point : file.Tables("point")) {
    program.points.push_back(ReadPoint(file, point));
  }
  for (const TomlFields& step : file.Tables("step")) {
    program.steps.push_back(ReadStep(program, step));
  }
  return program;
}

MotionProgram BuiltinProgram(const CellDescription& cell) {
  MotionProgram program;
  program.home.resize(cell.size());
  for (int i = 0; i < cell.size(); ++i) {
    const JointDescription& joint = cell.joints[static_cast<std::size_t>(i)];
    const bool limited = std::isfinite(joint.min) && std::isfinite(joint.max);
    program.home[i] = limited ? (joint.min + joint.max) / 2 : 0;
  }
  program.payload_kg = 5;
  const auto beside = [&](double amount) {
    ProgramStep step;
    step.kind = ProgramStep::Kind::kJoints;
    step.joints = program.home;
    for (int i = 0; i < cell.size(); ++i) {
      if (!cell.joints[static_cast<std::size_t>(i)].prismatic) {
        step.joints[i] += amount * (i % 2 == 0 ? 1 : -1);
      }
    }
    return step;
  };
  const auto simple = [](ProgramStep::Kind kind, double wait_s = 0) {
    ProgramStep step;
    step.kind = kind;
    step.wait_s = wait_s;
    return step;
  };
  using Kind = ProgramStep::Kind;
  program.steps = {simple(Kind::kHome),    beside(-0.2), simple(Kind::kAttach),  beside(0.1),
                   simple(Kind::kWait, 2), beside(0.2),  simple(Kind::kWait, 2), beside(-0.1),
                   simple(Kind::kRelease)};
  return program;
}

}  // namespace virtual_cell
