// Effects of the measuring instrument, which a correction ignores.
#pragma once

#include "firmware-like/effects/contributions.h"

namespace plumbline::effects {

/// Measurement scale: an instrument with a wrong scale.
/// The instrument reads (1 + scale) times the position; for ranges, (1 + scale)
/// times the distance from the anchor (RangeAnchor). Unit: 1. The arm itself is not affected, so
/// a correction ignores this effect. From points alone it is indistinguishable from an arm whose
/// lengths all differ by the same ratio.
struct MeasurementScale : AddsFrom<Entries::kScale> {
  static EffectTraits Traits() {
    return {.id = "measurement_scale",
            .meaning = "the instrument's scale is wrong",
            .remedy =
                "calibrate the instrument against a known length; do not correct the robot for it",
            .formula = "p read = (1 + scale) p; a range is multiplied likewise",
            .shown_by =
                "a known length. From points alone it looks like an arm whose lengths all "
                "differ by one ratio",
            .sound_size = "laser tracker: 6e-6 [6 um/m, Leica AT500 manual]",
            .parameters = {{"scale", "1", 1, {-2e-3, 2e-3}}},
            .needs = {},
            .confused_with = {"link_geometry", "thermal_growth"}};
  }
};

/// Range zero error: ranges with a constant offset.
/// A measured range is too long by the value, because of the point where the wire leaves its drum,
/// or the prism offset of a distance meter. File unit: mm. Changes the reading, not the arm. Needs
/// [measurement] kind = "range".
struct RangeZero : AddsFrom<Entries::kRangeZero> {
  static EffectTraits Traits() {
    return {.id = "range_zero",
            .meaning = "every range is too long or too short by the same length",
            .remedy =
                "check the wire's length at its zero, or the prism constant; do not correct the "
                "robot for it",
            .formula = "range += zero",
            .shown_by = "short and long ranges in different directions",
            .parameters = {{"zero", "mm", 1e-3, {-50, 50}}},
            .needs = {Signal::kRange},
            .confused_with = {"range_anchor", "measurement_scale", "base_frame", "tool_frame"}};
  }
};

/// Range anchor error: an anchor of measured ranges that is not where it was declared.
/// Ranges are measured from anchor_mm + (x, y, z) in W:
///   range = (1 + measurement_scale) |p_WT - anchor - shift| + range_zero
/// File unit: mm. Changes the reading, not the arm; equivalent to a base that moved the opposite
/// way (base_frame). Needs [measurement] kind = "range".
struct RangeAnchor : AddsFrom<Entries::kRangeAnchor> {
  static EffectTraits Traits() {
    return {.id = "range_anchor",
            .meaning = "the anchor of the ranges is not where it was declared",
            .remedy = "measure the position of the anchor and correct anchor_mm",
            .formula = "range = |p - anchor - (x, y, z)|",
            .shown_by =
                "ranges in different directions and a known base: a base displaced the opposite"
                " way looks alike",
            .parameters = {{"x", "mm", 1e-3, {-50, 50}},
                           {"y", "mm", 1e-3, {-50, 50}},
                           {"z", "mm", 1e-3, {-50, 50}}},
            .needs = {Signal::kRange},
            .confused_with = {"range_zero", "base_frame", "tool_frame", "measurement_scale"}};
  }
};

/// Wrong tag size: the tags are larger or smaller than configured for the camera.
/// The camera scales distances by the configured tag size. If that is (1 + scale) times the actual
/// size, the tip appears further away along its ray:
///   p_WT read = c + (1 + scale) (p_WT - c),   c the camera's position in W.        Unit: 1.
/// The arm itself is not affected, so a correction ignores this effect. It is assumed that all tags
/// used for the tip have the same error and those used to locate the camera have none (if they have
/// the same error too, everything scales about the origin of W: measurement_scale). Equivalent to
/// measurement_scale plus a shift of -scale c: if the base is free, or c = 0, no data can separate
/// the two; with a known base, they are separable if scale |c| exceeds the noise.
struct CameraTagSize {
  static EffectTraits Traits() {
    return {.id = "camera_tag_size",
            .meaning = "the tags are not as large as configured",
            .remedy =
                "measure a tag's black border with a calliper and correct the size in the "
                "camera's configuration; do not correct the robot for it",
            .formula = "p read = c + (1 + scale) (p - c), c the position of the camera",
            .shown_by =
                "poses spread beside the optical axis as much as along it, and a known base and"
                " tool. Not separable from measurement_scale with frame = \"unaligned\" or a "
                "camera in the origin of W",
            .parameters = {{"scale", "1", 1, {-0.3, 0.3}}},
            .needs = {Signal::kCamera},
            .confused_with = {"measurement_scale", "camera_zoom", "link_geometry"},
            .name = "a wrong tag size"};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.camera) return;
    for (const T& scale : values) influence[Influence<T>::kCameraScale] += scale;
  }
};

/// Uncorrected zoom change: the zoom or focus has changed, but the old focal length is used.
/// A body of known size is imaged with the focal length f, but its pose is solved with f (1 +
/// scale). Its image position x relative to the optical axis is consistent with any depth, as
/// X = x Z / f, but its image size requires the depth (1 + scale) Z. The reading is therefore
/// stretched along the optical axis, not along the ray:
///   Z read = (1 + scale) Z,  X and Y unchanged, in the camera frame.         Unit: 1.
/// Acts from an event onwards (t_s >= time, or row number >= row, counted from 1), or in all rows
/// if no event time is given; zooming in and out again is modelled as two effects of opposite sign.
/// The event time has no derivative and must be found by search; if zoom_counts was recorded, only
/// the times at which it changes are candidates. Valid for bodies that are small compared with
/// their distance and a camera whose pose was determined before the change. A principal point that
/// moves with the zoom acts like a rotated camera, equivalent to base_frame. Separable from
/// camera_tag_size if the poses are spread across the optical axis as well as along it, by at least
/// about 6 sigma / scale; from a step of the base if their depths differ.
struct CameraZoom {
  enum Parameter { kTime, kRow, kScale };

  static EffectTraits Traits() {
    return {.id = "camera_zoom",
            .meaning = "the camera was zoomed or focused but measures with its old focal length",
            .remedy =
                "calibrate the lens at this zoom, or zoom back, and measure again; do not "
                "correct the robot for it",
            .formula =
                "Z read = (1 + scale) Z in the camera frame, X and Y unchanged, from the moment"
                " on",
            .shown_by =
                "poses at several depths and spread beside the optical axis, before and after "
                "the moment",
            .parameters = {{"time", "s", 1, {0, 1e7}, ParameterRole::kShape},
                           {"row", "1", 1, {1, 1e6}, ParameterRole::kShape},
                           {"scale", "1", 1, {-0.3, 0.3}}},
            .needs = {Signal::kCamera},
            .confused_with = {"camera_tag_size", "camera_lens", "measurement_scale", "step_event"},
            .name = "an uncorrected zoom change"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.camera) return;
    bool waits = false, begun = false;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int spec = term.parameters[k].spec;
      if (spec == kTime) begun = begun || (conditions.t_s && *conditions.t_s >= values[k]);
      if (spec == kRow) begun = begun || (conditions.row && *conditions.row >= values[k]);
      waits = waits || spec == kTime || spec == kRow;
    }
    if (waits && !begun) return;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (term.parameters[k].spec == kScale) influence[Influence<T>::kCameraDepth] += values[k];
    }
  }
};

/// Stale lens: lens distortion that has changed since calibration.
/// The actual k1 exceeds the calibrated one (OpenCV's first radial coefficient) by the value. With
/// r^2 = (X^2 + Y^2) / Z^2, a ray appears at (1 + k1 r^2) times its angle, and a body there appears
/// larger by 1 + 2 k1 r^2, the mean of 3 k1 r^2 radially and k1 r^2 tangentially, and therefore
/// closer:
///   X, Y read = (1 - k1 r^2) X, Y,   Z read = (1 - 2 k1 r^2) Z, in the camera frame.  Unit: 1.
/// First order in k1. For a flat body the factor 2 is between 1 and 3, depending on its tilt; for a
/// body with tags facing several ways it is 2. The tip is assumed to be next to the body. Separable
/// from camera_zoom and camera_tag_size if there are poses both near the centre and at the edge of
/// the image.
struct CameraLens {
  static EffectTraits Traits() {
    return {.id = "camera_lens",
            .meaning = "the lens distortion has changed since calibration",
            .remedy =
                "calibrate the lens at this zoom and focus, and measure again; do not correct "
                "the robot for it",
            .formula =
                "X, Y read = (1 - k1 r^2) X, Y; Z read = (1 - 2 k1 r^2) Z; r^2 = (X^2 + Y^2) / "
                "Z^2",
            .shown_by = "poses near the centre of the image and at its edge",
            .parameters = {{"k1", "1", 1, {-0.5, 0.5}}},
            .needs = {Signal::kCamera},
            .confused_with = {"camera_zoom", "camera_tag_size", "measurement_scale"},
            .name = "a stale lens"};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.camera) return;
    for (const T& k1 : values) influence[Influence<T>::kCameraRadial] += k1;
  }
};

/// Camera frame error: one of several cameras measures with another pose and scale than the others.
/// The rows of one camera are displaced rigidly and enlarged; to first order
///   p read = (1 + scale) (p_WB + (x, y, z) + (p - p_WB) + (roll, pitch, yaw) x (p - p_WB)),
/// with the tip p and the origin of the base p_WB in W, rotations about the axes of W, and the
/// scale about the origin of W. Its causes are the lens (focal length, distortion) and the pose in
/// which the camera was located. `camera` names the camera as the rows do, "side+rear" for means of
/// two. The arm itself is not affected, so a correction ignores this effect. Unlike base_frame it
/// does not rotate gravity; valid for a vertical gravity in W and angles up to a degree. If all
/// rows are of one camera, base_frame and measurement_scale are equivalent, so it is considered
/// only if the rows are of different instruments. If the base is free, no data can decide which
/// camera has a wrong pose; a wrong scale contradicts the lengths of the arm. File units: mm, deg,
/// 1.
struct CameraFrame {
  /// The named cameras, and the means of two.
  static constexpr std::string_view kCameras =
      "side,rear,front,top,side+rear,side+front,side+top,rear+front,rear+top,front+top";

  static EffectTraits Traits() {
    return {.id = "camera_frame",
            .meaning = "one camera measures with another pose or scale than the others",
            .remedy =
                "calibrate the lens of that camera again and check its view of the reference "
                "tags; do not correct the robot for it",
            .formula =
                "p read = (1 + scale) (p + (x, y, z) + (roll, pitch, yaw) x (p - p_WB)), rows "
                "of one camera",
            .shown_by =
                "the same region measured by both cameras. With frame = \"unaligned\" nothing "
                "decides which one has the wrong pose",
            .parameters = {{"x", "mm", 1e-3, {-20, 20}},
                           {"y", "mm", 1e-3, {-20, 20}},
                           {"z", "mm", 1e-3, {-20, 20}},
                           {"roll", "deg", kRadPerDeg, {-1, 1}},
                           {"pitch", "deg", kRadPerDeg, {-1, 1}},
                           {"yaw", "deg", kRadPerDeg, {-1, 1}},
                           {"scale", "1", 1, {-1e-2, 1e-2}},
                           {.name = "camera", .role = ParameterRole::kWord, .words = kCameras}},
            .needs = {Signal::kCameras},
            .confused_with = {"base_frame", "measurement_scale", "camera_tag_size"},
            .independent_parameters = true,
            .name = "frame of one camera",
            .of_one_camera = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (conditions.camera_name.empty() || conditions.camera_name != term.word) return;
    constexpr int kRoll = 3, kYaw = 5;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int spec = term.parameters[k].spec;
      if (spec < kRoll) {
        influence[Influence<T>::kBase + spec] += values[k];
      } else if (spec < kYaw) {
        // Gravity rotates with the base, so that only the reading changes.
        influence[Influence<T>::kBaseTilt + spec - kRoll] += values[k];
        influence[Influence<T>::kGravityTurnX + spec - kRoll] += values[k];
      } else if (spec == kYaw) {
        influence[Influence<T>::kBaseRollPitchYaw + 2] += values[k];
      } else {
        influence[Influence<T>::kScale] += values[k];
      }
    }
  }
};

}  // namespace plumbline::effects
