#include "app/programs/brands/urscript_functions.h"

#include <algorithm>

namespace plumbline::programs::urscript {

namespace {

constexpr std::string_view kServo = "servo motion: the point is the set point of a running loop";
constexpr std::array<MotionFunction, 6> kMotions = {{
    {"movej", MotionKind::kJoint, {"q", ""}, 4, ""},
    {"movel", MotionKind::kLinear, {"pose", ""}, 4, ""},
    {"movep", MotionKind::kLinear, {"pose", ""}, 3, ""},
    {"movec", MotionKind::kCircular, {"pose_via", "pose_to"}, 4, ""},
    {"servoj", MotionKind::kJoint, {"q", ""}, 0, kServo},
    {"servoc", MotionKind::kCircular, {"pose", ""}, 0, kServo},
}};

constexpr std::array<ShiftFunctions, 6> kShifts = {{
    {"force_mode", "end_force_mode", "force control moves the robot off its targets"},
    {"path_offset_enable", "path_offset_disable", "path offsets are added while it runs"},
    {"path_offset_set", "path_offset_disable", "path offsets are added while it runs"},
    {"track_conveyor_linear", "stop_conveyor_tracking", "the targets follow a conveyor"},
    {"track_conveyor_circular", "stop_conveyor_tracking", "the targets follow a conveyor"},
    {"screw_driving", "end_screw_driving", "the robot follows a screw"},
}};

constexpr std::array<std::string_view, 5> kSettings = {"set_tcp", "set_payload", "set_payload_mass",
                                                       "set_payload_cog", "set_target_payload"};

constexpr std::array<std::string_view, 20> kHarmlessStarts = {
    "set_",  "get_",         "is_",    "read_",    "write_",  "modbus_", "socket_",
    "rtde_", "str_",         "to_",    "pose_",    "power",   "enter_",  "exit_",
    "rpc_",  "interpolate_", "point_", "integer_", "binary_", "zero_"};
constexpr std::array<std::string_view, 40> kHarmless = {"textmsg",
                                                        "popup",
                                                        "sleep",
                                                        "sync",
                                                        "sin",
                                                        "cos",
                                                        "tan",
                                                        "asin",
                                                        "acos",
                                                        "atan",
                                                        "atan2",
                                                        "sqrt",
                                                        "pow",
                                                        "exp",
                                                        "log",
                                                        "abs",
                                                        "floor",
                                                        "ceil",
                                                        "norm",
                                                        "random",
                                                        "d2r",
                                                        "r2d",
                                                        "rotvec2rpy",
                                                        "rpy2rotvec",
                                                        "length",
                                                        "size",
                                                        "inv",
                                                        "force",
                                                        "stop",
                                                        "stopj",
                                                        "stopl",
                                                        "assert",
                                                        "transpose",
                                                        "normalize",
                                                        "make_list",
                                                        "wrench_trans",
                                                        "request_boolean_from_primary_client",
                                                        "end_freedrive_mode",
                                                        "end_teach_mode",
                                                        "not"};

}  // namespace

const MotionFunction* FindMotion(std::string_view function) {
  for (const MotionFunction& motion : kMotions) {
    if (motion.name == function) return &motion;
  }
  return nullptr;
}

const ShiftFunctions* FindShift(std::string_view function) {
  for (const ShiftFunctions& shift : kShifts) {
    if (shift.begins == function || shift.ends == function) return &shift;
  }
  return nullptr;
}

FunctionKind KindOf(std::string_view function) {
  const auto is = [&](const auto& names) {
    return std::find(names.begin(), names.end(), function) != names.end();
  };
  if (FindMotion(function) != nullptr) return FunctionKind::kMotion;
  if (FindShift(function) != nullptr) return FunctionKind::kShift;
  if (is(kSettings)) return FunctionKind::kSetting;
  // A method of an object, rpc.name(..), runs outside the robot program.
  const bool harmless =
      is(kHarmless) || function.find('.') != std::string_view::npos ||
      std::any_of(kHarmlessStarts.begin(), kHarmlessStarts.end(),
                  [&](std::string_view start) { return function.starts_with(start); });
  return harmless ? FunctionKind::kHarmless : FunctionKind::kOther;
}

}  // namespace plumbline::programs::urscript
