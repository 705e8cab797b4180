// Posture block of a configured point: the joint values that its command pose was solved with.
#include <array>

#include "drivers/plc/register_values.h"

namespace plumbline::plc {
namespace {

using enum FieldType;

template <int K>
double PostureJoint(Source s) {
  const model::JointVector& q = s.point->correction.q;
  return K < q.size() ? JointInRegisterUnit(s, K, q[K]) : 0;
}

double PostureBits(Source s) {
  const correction::PointPosture& posture = s.point->posture;
  int bits = s.point->valid ? registers::kPostureValid : 0;
  if (posture.taught) bits |= registers::kPostureTaught;
  if (posture.differs) bits |= registers::kPostureDiffers;
  return bits;
}

const std::array kPostureFields = {
    MapField{0, kFloat, "posture_q1", "deg",
             "joint 1 of the commanded posture (mm if prismatic); 0 for joints that the robot does "
             "not have",
             PostureJoint<0>},
    MapField{2, kFloat, "posture_q2", "deg", "", PostureJoint<1>},
    MapField{4, kFloat, "posture_q3", "deg", "", PostureJoint<2>},
    MapField{6, kFloat, "posture_q4", "deg", "", PostureJoint<3>},
    MapField{8, kFloat, "posture_q5", "deg", "", PostureJoint<4>},
    MapField{10, kFloat, "posture_q6", "deg", "", PostureJoint<5>},
    MapField{12, kFloat, "posture_q7", "deg", "", PostureJoint<6>},
    MapField{14, kFloat, "posture_q8", "deg", "", PostureJoint<7>},
    MapField{16, kFloat, "posture_q9", "deg", "", PostureJoint<8>},
    MapField{18, kFloat, "posture_q10", "deg", "", PostureJoint<9>},
    MapField{20, kFloat, "posture_q11", "deg", "", PostureJoint<10>},
    MapField{22, kFloat, "posture_q12", "deg", "", PostureJoint<11>},
    MapField{24, kU16, "posture_validity", "bits",
             "bit 0 valid, 1 near_deg is configured, 2 the posture differs from near_deg",
             PostureBits},
    MapField{25, kU16, "posture_limit_joint", "",
             "joint closest to one of its limits, counted from 1; 0: no joint has limits",
             [](Source s) { return static_cast<double>(s.point->posture.limit.joint + 1); }},
    MapField{26, kFloat, "posture_limit_distance", "deg",
             "distance of that joint from its limit (mm if prismatic); 0 if no joint has limits",
             [](Source s) {
               const correction::JointDistance& limit = s.point->posture.limit;
               return limit.joint < 0 ? 0 : JointInRegisterUnit(s, limit.joint, limit.distance);
             }},
    MapField{28, kFloat, "posture_singular_value", "",
             "smallest singular value of the tip Jacobian, metres and radians weighted equally; "
             "near 0: singular",
             [](Source s) { return s.point->correction.singular_value; }},
    MapField{30, kFloat, "posture_qw", "",
             "w of the point's command orientation as a quaternion, see register 3",
             [](Source s) { return QuaternionScalar(s.point->correction.X_BP_command.R); }},
};

constexpr std::array kPostureBits = {
    BitMeaning{registers::kPostureValid, "valid"},
    BitMeaning{registers::kPostureTaught, "near_deg is configured"},
    BitMeaning{registers::kPostureDiffers, "the posture differs from near_deg"},
};

}  // namespace

std::span<const MapField> registers::PostureFields() {
  return kPostureFields;
}
std::span<const BitMeaning> registers::PostureBits() {
  return kPostureBits;
}

}  // namespace plumbline::plc
