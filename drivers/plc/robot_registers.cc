// Registers 300-365: robot state as decoded, and its motion.
#include <array>
#include <cmath>

#include "drivers/plc/register_values.h"

namespace plumbline::plc {
namespace {

using enum FieldType;

template <int K>
double Joint(Source s) {
  const model::JointVector& q = s.snapshot.reading.q;
  return K < q.size() ? JointInRegisterUnit(s, K, q[K]) : 0;
}
template <int K>
double Tcp(Source s) {
  if (!s.snapshot.reading.X_BT) return 0;
  const Pose& X_BT = *s.snapshot.reading.X_BT;
  return K < 3 ? kMmPerMetre * X_BT.p[K % 3] : Angle_deg(X_BT, s, K % 3);
}
template <int K>
double Cog_mm(Source s) {
  return kMmPerMetre * s.snapshot.payload.cog_F[K];
}
template <int K>
double DynamicTip_mm(Source s) {
  return kMmPerMetre * s.snapshot.motion.deflection.tip_W[K];
}
double InputBits(Source s) {
  const Snapshot& snapshot = s.snapshot;
  const model::RobotState& reading = snapshot.reading;
  int bits = snapshot.input_fault == InputFault::kOk ? 1 : 0;
  if (reading.X_BT && reading.X_BT->p.allFinite() && reading.X_BT->R.allFinite()) bits |= 2;
  if (snapshot.payload_valid) bits |= 4;
  if (reading.temp_C && std::isfinite(*reading.temp_C)) bits |= 8;
  return bits;
}

const std::array kRobotFields = {
    // 300-365 robot state as decoded, and its motion
    MapField{300, kU16, "input_validity", "bits",
             "bit 0 passed the plausibility checks, 1 the controller reports a TCP pose, 2 payload "
             "known, 3 the controller reports a temperature",
             InputBits},
    MapField{301, kU16, "input_fault", "code",
             "why the robot state is not trusted, see below; 0: it is",
             [](Source s) { return static_cast<double>(s.snapshot.input_fault); }},
    MapField{302, kU16, "robot_mode", "code",
             "0 unknown, 1 not ready, 2 running, 3 manual, 4 stopped, 5 emergency stop",
             [](Source s) { return static_cast<double>(s.snapshot.reading.mode); }},
    MapField{303, kU16, "joints", "", "number of joints, 1 to 12; 0: no reading yet",
             [](Source s) { return static_cast<double>(s.snapshot.reading.q.size()); }},
    MapField{304, kFloat, "q1", "deg",
             "joint 1 as decoded (mm if prismatic); 0 for joints that the robot does not have",
             Joint<0>},
    MapField{306, kFloat, "q2", "deg", "", Joint<1>},
    MapField{308, kFloat, "q3", "deg", "", Joint<2>},
    MapField{310, kFloat, "q4", "deg", "", Joint<3>},
    MapField{312, kFloat, "q5", "deg", "", Joint<4>},
    MapField{314, kFloat, "q6", "deg", "", Joint<5>},
    MapField{316, kFloat, "q7", "deg", "", Joint<6>},
    MapField{318, kFloat, "tcp_x", "mm",
             "TCP pose reported by the controller, robot base frame; 0 if it reports none (bit 1 "
             "of 300)",
             Tcp<0>},
    MapField{320, kFloat, "tcp_y", "mm", "", Tcp<1>},
    MapField{322, kFloat, "tcp_z", "mm", "", Tcp<2>},
    MapField{324, kFloat, "tcp_rx", "deg", "", Tcp<3>},
    MapField{326, kFloat, "tcp_ry", "deg", "", Tcp<4>},
    MapField{328, kFloat, "tcp_rz", "deg", "", Tcp<5>},
    MapField{330, kFloat, "payload", "kg", "payload mass used for the correction",
             [](Source s) { return s.snapshot.payload.mass_kg; }},
    MapField{332, kFloat, "cog_x", "mm", "centre of gravity of the payload in the flange frame",
             Cog_mm<0>},
    MapField{334, kFloat, "cog_y", "mm", "", Cog_mm<1>},
    MapField{336, kFloat, "cog_z", "mm", "", Cog_mm<2>},
    MapField{338, kFloat, "temperature", "degC",
             "temperature reported by the controller; 0 if it reports none (bit 3 of 300)",
             [](Source s) { return s.snapshot.reading.temp_C.value_or(0.0); }},
    MapField{340, kFloat, "reading_radius", "mm",
             "95 % radius at the tip due to the resolution of the joint registers",
             [](Source s) { return kMmPerMetre * s.snapshot.reading_radius_m; }},
    MapField{342, kFloat, "q8", "deg", "joints 8 to 12, as 304", Joint<7>},
    MapField{344, kFloat, "q9", "deg", "", Joint<8>},
    MapField{346, kFloat, "q10", "deg", "", Joint<9>},
    MapField{348, kFloat, "q11", "deg", "", Joint<10>},
    MapField{350, kFloat, "q12", "deg", "", Joint<11>},
    MapField{352, kU16, "motion_state", "code",
             "0 unknown, 1 at standstill, 2 moving: use 353-363, 3 moving but the readings change "
             "too rarely for an acceleration, 4 moving but payload or link masses are unknown",
             [](Source s) { return static_cast<double>(s.snapshot.motion.state); }},
    MapField{353, kU16, "motion_age", "ms",
             "age of the instant that 354-363 describe; 0 unless motion_state is 2",
             [](Source s) { return std::floor(1e3 * s.snapshot.motion.age_s); }},
    MapField{354, kFloat, "tip_acceleration", "m/s2",
             "acceleration of the tip, from the joint readings; 0 unless motion_state is 2",
             [](Source s) { return s.snapshot.motion.deflection.tip_acceleration_W.norm(); }},
    MapField{356, kFloat, "dynamic_x", "mm",
             "displacement of the tip by the motion, measurement frame; no correction contains it",
             DynamicTip_mm<0>},
    MapField{358, kFloat, "dynamic_y", "mm", "", DynamicTip_mm<1>},
    MapField{360, kFloat, "dynamic_z", "mm", "", DynamicTip_mm<2>},
    MapField{362, kFloat, "dynamic_radius", "mm",
             "95 % radius of that displacement due to the scatter of the readings alone",
             [](Source s) { return kMmPerMetre * s.snapshot.motion.radius_m; }},
    MapField{364, kU16, "undeclared", "code",
             "why the payload is unknown: 1 the controller's tool number is not declared, 2 its "
             "payload item is not; 0: neither",
             [](Source s) { return static_cast<double>(s.snapshot.undeclared.kind); }},
    MapField{365, kU16, "undeclared_number", "",
             "that number; 65535: the controller reports none; 0 unless 364 is set",
             [](Source s) -> double {
               const UndeclaredNumber& undeclared = s.snapshot.undeclared;
               if (undeclared.kind == UndeclaredNumber::Kind::kNone) return 0;
               return undeclared.number.value_or(65535);
             }},
};

}  // namespace

std::span<const MapField> registers::RobotFields() {
  return kRobotFields;
}

}  // namespace plumbline::plc
