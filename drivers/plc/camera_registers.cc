// Registers 500..635, repeated 200 registers further for the second camera: lens, tip and tracked
// bodies.
#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/plc/register_values.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::plc {
namespace {

constexpr std::int32_t kNoTag = 65535;
using enum FieldType;

const status::CameraStatus& Camera(Source s) {
  return *s.camera;
}

double TipRadius_mm(Source s) {
  return kMmPerMetre * statistics::RadiusHolding95Percent(Camera(s).tip_covariance_W +
                                                          Camera(s).tip_tag_covariance_W);
}

/// Rounded down, so that no pixel within it lies outside the usable region.
double UsableRadius_px(Source s) {
  const double radius_px = Camera(s).usable_radius_px.value_or(0);
  return radius_px < registers::kWholeImage ? std::floor(radius_px) : registers::kWholeImage;
}

template <int K>
double Tip_mm(Source s) {
  return kMmPerMetre * Camera(s).tip_W[K];
}
template <int K>
double BodyPosition_mm(Source s) {
  return kMmPerMetre * s.body->X_WK.p[K];
}
template <int K>
double BodyAngle_deg(Source s) {
  return Angle_deg(s.body->X_WK, s, K);
}

const std::array kCameraFields = {
    MapField{500, kU16, "camera_state", "code",
             "0 no camera, 1 unknown, 2 moving, 3 verifying, 4 valid, 5 stale, 6 calibrating, "
             "7 refused",
             [](Source s) {
               return Camera(s).configured ? 1 + static_cast<double>(Camera(s).state) : 0;
             }},
    MapField{501, kU16, "camera_reason", "code", "reason for the state, see below",
             [](Source s) { return static_cast<double>(Camera(s).reason); }},
    MapField{502, kU16, "camera_bits", "bits", "camera word, see below",
             [](Source s) -> double { return registers::CameraWord(Camera(s)); }},
    MapField{503, kU16, "board_prompt", "code",
             "what the operator should do with the calibration board, see below",
             [](Source s) { return static_cast<double>(Camera(s).prompt); }},
    MapField{504, kU16, "board_views", "", "board views accepted in this capture",
             [](Source s) -> double { return Camera(s).board_views; }},
    MapField{505, kU16, "camera_age", "ms",
             "age of the last frame; 65535: older than that, or no frame yet",
             [](Source s) { return Age_ms(s, Camera(s).frame_time_s); }},
    MapField{506, kI32, "zoom", "counts",
             "zoom position in counts of its sensor; 0 if unknown (bit 2 of camera_bits)",
             [](Source s) -> double { return Camera(s).zoom_counts.value_or(0); }},
    MapField{508, kI32, "focus", "counts",
             "focus position in counts of its sensor; 0 if the sensor does not report it",
             [](Source s) -> double { return Camera(s).focus_counts.value_or(0); }},
    MapField{510, kU32, "lens", "",
             "number of the lens in the lens store; 0: none, or an interpolated lens",
             [](Source s) -> double { return Camera(s).lens_id; }},
    MapField{512, kU16, "zoom_age", "ms",
             "age of the last zoom reading; 65535: older than that, or no reading yet",
             [](Source s) { return Age_ms(s, Camera(s).zoom_time_s); }},
    MapField{513, kU16, "bodies", "", "number of tracked bodies that have a block, 0 to 6",
             [](Source s) { return static_cast<double>(Camera(s).bodies_configured); }},
    MapField{514, kFloat, "tip_x", "mm",
             "tool tip measured by camera, measurement frame; use it only if bit 0 of tip_validity "
             "is set",
             Tip_mm<0>},
    MapField{516, kFloat, "tip_y", "mm", "", Tip_mm<1>},
    MapField{518, kFloat, "tip_z", "mm", "", Tip_mm<2>},
    MapField{520, kFloat, "tip_radius", "mm", "95 % radius of the measured tip", TipRadius_mm},
    MapField{522, kU16, "tip_age", "ms",
             "age of the frame that the tip was measured in; 65535: older than that, or never",
             [](Source s) { return Age_ms(s, Camera(s).tip_time_s); }},
    MapField{523, kU16, "tip_validity", "bits",
             "bit 0 valid: the lens is valid and the tool was at standstill",
             [](Source s) -> double { return Camera(s).tip_valid ? registers::kValid : 0; }},
    MapField{524, kU16, "camera_name", "code", "0 none, 1 side, 2 rear, 3 front, 4 top",
             [](Source s) { return static_cast<double>(Camera(s).name); }},
    MapField{525, kU16, "contradicting_tags", "",
             "number of reference tags that contradict the others, or each other",
             [](Source s) { return static_cast<double>(Camera(s).contradicting_count); }},
    MapField{526, kU16, "contradicting_tag", "", "id of the first of them; 65535: none",
             [](Source s) -> double {
               return Camera(s).contradicting_count > 0
                          ? std::min(Camera(s).contradicting_tags[0], kNoTag)
                          : kNoTag;
             }},
    MapField{527, kU16, "lens_usable_radius", "px",
             "the lens is trusted within this distance from the middle of the image, and nothing "
             "is measured beyond it; 65535: the whole image; 0: no lens in use",
             UsableRadius_px},
};

const std::array kBodyFields = {
    MapField{0, kU16, "body_validity", "bits",
             "bit 0 valid, 1 ambiguous: a second pose fits equally well",
             [](Source s) -> double {
               return (s.body->valid ? 1 : 0) + (s.body->valid && s.body->ambiguous ? 2 : 0);
             }},
    MapField{1, kU16, "body_age", "ms",
             "age of the last frame that shows the body; 65535: older than that, or none",
             [](Source s) { return Age_ms(s, s.body->time_s); }},
    MapField{2, kFloat, "body_x", "mm",
             "origin of the body, measurement frame; use it only if bit 0 of body_validity is set",
             BodyPosition_mm<0>},
    MapField{4, kFloat, "body_y", "mm", "", BodyPosition_mm<1>},
    MapField{6, kFloat, "body_z", "mm", "", BodyPosition_mm<2>},
    MapField{8, kFloat, "body_rx", "deg", "orientation, convention of register 3",
             BodyAngle_deg<0>},
    MapField{10, kFloat, "body_ry", "deg", "", BodyAngle_deg<1>},
    MapField{12, kFloat, "body_rz", "deg", "", BodyAngle_deg<2>},
    MapField{14, kFloat, "body_radius", "mm", "95 % radius of the origin",
             [](Source s) { return kMmPerMetre * s.body->radius_m; }},
};

struct CameraBit {
  BitMeaning bit;
  bool status::CameraStatus::*flag;
};
constexpr std::array kCameraFlags = {
    CameraBit{{1 << 0, "lens not valid: do not use what this camera measures"},
              &status::CameraStatus::lens_stale},
    CameraBit{{1 << 1, "camera lost: no frames arrive"}, &status::CameraStatus::camera_lost},
    CameraBit{{1 << 2, "zoom position unknown"}, &status::CameraStatus::zoom_unknown},
    CameraBit{{1 << 3, "calibration board required"}, &status::CameraStatus::board_wanted},
    CameraBit{{1 << 4, "reference tags not visible"}, &status::CameraStatus::fiducials_hidden},
    CameraBit{{1 << 5, "a reference tag has moved"}, &status::CameraStatus::fiducial_moved},
    CameraBit{{1 << 6, "lenses cannot be stored"}, &status::CameraStatus::store_fault},
    CameraBit{{1 << 7, "tags are read as drawn by OpenCV: set drawn_by in bodies.toml"},
              &status::CameraStatus::opencv_prints},
    CameraBit{{1 << 8, "the lens rests on the declaration no_window of [camera]"},
              &status::CameraStatus::rests_on_no_window},
    CameraBit{{1 << 9, "the lens rests on the declaration fixed_focus of [camera]"},
              &status::CameraStatus::rests_on_fixed_focus},
};
constexpr auto kCameraBits = [] {
  std::array<BitMeaning, kCameraFlags.size()> bits{};
  for (std::size_t k = 0; k < bits.size(); ++k) bits[k] = kCameraFlags[k].bit;
  return bits;
}();

}  // namespace

std::span<const MapField> registers::CameraFields() {
  return kCameraFields;
}
std::span<const MapField> registers::BodyFields() {
  return kBodyFields;
}
std::span<const BitMeaning> registers::CameraBits() {
  return kCameraBits;
}
std::uint16_t registers::CameraWord(const status::CameraStatus& camera) {
  int word = 0;
  for (const CameraBit& bit : kCameraFlags) word |= camera.*bit.flag ? bit.bit.mask : 0;
  return static_cast<std::uint16_t>(word);
}

}  // namespace plumbline::plc
