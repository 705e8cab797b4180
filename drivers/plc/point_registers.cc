// Point block: corrected pose of a configured point.
#include <array>

#include "drivers/plc/register_values.h"

namespace plumbline::plc {
namespace {

using enum FieldType;

double PointBits(Source s) {
  int bits = s.point->valid ? registers::kValid : 0;
  if (s.point->correction.extrapolated) bits |= registers::kExtrapolated;
  if (s.point->ever_valid) bits |= registers::kEverValid;
  if (s.point->posture.differs) bits |= registers::kPointPostureDiffers;
  return bits | BasisBits(s.point->correction);
}

template <int K>
double PointPosition_mm(Source s) {
  return kMmPerMetre * s.point->correction.X_BP_command.p[K];
}
template <int K>
double PointAngle_deg(Source s) {
  return Angle_deg(s.point->correction.X_BP_command, s, K);
}

const std::array kPointFields = {
    MapField{0, kU16, "point_id", "", "id of the point",
             [](Source s) -> double { return s.point_id; }},
    MapField{1, kU16, "point_validity", "bits",
             "bit 0 valid, 1 extrapolated, 2 has been valid since the daemon started (the pose is "
             "the last valid one), 4-5 basis of the 95 % radius as in 103, 6 the posture differs "
             "from the taught one",
             PointBits},
    MapField{2, kU16, "point_code", "code", "0 ok, otherwise why there is no correction",
             [](Source s) { return Number(s.point->code); }},
    MapField{
        3, kFloat, "point_x", "mm",
        "command pose of the TCP, robot base frame; use it only if bit 0 of point_validity is set",
        PointPosition_mm<0>},
    MapField{5, kFloat, "point_y", "mm", "", PointPosition_mm<1>},
    MapField{7, kFloat, "point_z", "mm", "", PointPosition_mm<2>},
    MapField{9, kFloat, "point_rx", "deg", "orientation, convention of register 3",
             PointAngle_deg<0>},
    MapField{11, kFloat, "point_ry", "deg", "", PointAngle_deg<1>},
    MapField{13, kFloat, "point_rz", "deg", "", PointAngle_deg<2>},
    MapField{15, kFloat, "point_correction", "mm", "magnitude of the translational correction",
             [](Source s) { return kMmPerMetre * s.point->correction.translation_B.norm(); }},
    MapField{17, kFloat, "point_uncertainty", "mm",
             "95 % radius of the landing position; basis in bits 4-5 of point_validity",
             [](Source s) { return kMmPerMetre * s.point->correction.uncertainty_m; }},
    MapField{19, kU16, "point_sequence", "",
             "increments with every refresh, wraps after 65535; constant while not valid",
             [](Source s) -> double { return s.point->sequence; }},
};

}  // namespace

std::span<const MapField> registers::PointFields() {
  return kPointFields;
}

}  // namespace plumbline::plc
