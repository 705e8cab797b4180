#include "app/vision/hand_eye/hand_eye_json.h"

#include <fmt/format.h>

#include <cmath>

#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/vision/lens/lens_model.h"
#include "app/vision/tracking/pose_json.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::vision {
namespace {

using Json = nlohmann::ordered_json;

bool IsSet(const PoseWithCovariance& pose) {
  return pose.covariance.trace() > 0;
}

Json PoseJson(const PoseWithCovariance& pose, const char* frame) {
  if (!IsSet(pose)) return nullptr;
  Vec6 to_file;
  to_file << Vec3::Constant(kMmPerMetre), Vec3::Ones();
  const Mat6 covariance = to_file.asDiagonal() * pose.covariance * to_file.asDiagonal();
  Json matrix = Json::array();
  for (int i = 0; i < 6; ++i) {
    Json row = Json::array();
    for (int j = 0; j < 6; ++j) row.push_back(covariance(i, j));
    matrix.push_back(std::move(row));
  }
  return {{"in", frame},
          {"xyz_mm", JsonOfVector(kMmPerMetre * pose.X.p)},
          {"rpy_deg", JsonOfVector(RollPitchYawFromRotation(pose.X.R) / kRadPerDeg)},
          {"quaternion_wxyz", JsonOfRotation(pose.X.R)},
          {"covariance",
           {{"order", {"x_mm", "y_mm", "z_mm", "rx_rad", "ry_rad", "rz_rad"}},
            {"matrix", std::move(matrix)}}}};
}

Json ErrorJson(const HandEyeError& error) {
  return {{"rms_px", error.rms_px}, {"position_mm", kMmPerMetre * error.position_m}};
}

Json LensJson(const HandEye& result) {
  const lens::Lens& lens = result.lens.lens;
  Json sds;
  for (int k = 0; k < kLensCount; ++k)
    sds[lens::kLensParameterNames[k]] = std::sqrt(std::max(0.0, result.lens.covariance(k, k)));
  return {{"fx", lens.fx},
          {"fy", lens.fy},
          {"cx", lens.cx},
          {"cy", lens.cy},
          {"model", lens::ModelName(lens::ModelOf(lens))},
          {"distortion", lens::DistortionOf(lens)},
          {"sd", sds}};
}

std::string PoseLine(const char* what, const char* frame, const PoseWithCovariance& pose) {
  const Vec3 p = kMmPerMetre * pose.X.p, rpy = RollPitchYawFromRotation(pose.X.R) / kRadPerDeg;
  const Vec6 sd = pose.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Vec3 p_sd = kMmPerMetre * sd.head<3>();
  const double rotation_sd = sd.tail<3>().norm() / kRadPerDeg;
  const int mm = text::DecimalsFor({p_sd.x(), p_sd.y(), p_sd.z()}, 2),
            deg = text::DecimalsFor({rotation_sd}, 3);
  return fmt::format(
      "  {} in the {}: {:.{}f}, {:.{}f}, {:.{}f} mm (+- {:.{}f}, {:.{}f}, {:.{}f}); roll, pitch, "
      "yaw {:.{}f}, {:.{}f}, {:.{}f} deg (+- {:.{}f})\n",
      what, frame, p.x(), mm, p.y(), mm, p.z(), mm, p_sd.x(), mm, p_sd.y(), mm, p_sd.z(), mm,
      rpy.x(), deg, rpy.y(), deg, rpy.z(), deg, rotation_sd, deg);
}

}  // namespace

std::string HandEyeJson(const HandEye& result, const HandEyeOptions& options, const Pose* X_WB) {
  const bool to_hand = options.setup == HandEyeSetup::kEyeToHand;
  const bool found = IsSet(result.camera);
  Json refused = Json::array(), offsets = Json::array();
  for (const RefusedView& view : result.refused)
    refused.push_back({{"name", view.name}, {"reason", view.reason}});
  for (Eigen::Index i = 0; i < result.joint_offsets.size(); ++i) {
    if (result.joint_offset_sds[i] <= 0) continue;
    offsets.push_back({{"name", fmt::format("q{}", i + 1)},
                       {"value", result.joint_offsets[i]},
                       {"sd", result.joint_offset_sds[i]},
                       {"unit", "rad"}});
  }
  Json root = {
      {"schema", 1},
      {"accepted", result.accepted},
      {"reasons", result.reasons},
      {"setup", to_hand ? "eye-to-hand" : "eye-in-hand"},
      {"camera", PoseJson(result.camera, to_hand ? "base" : "flange")},
      {"target", PoseJson(result.target, to_hand ? "flange" : "base")},
      {"point_sd_mm", found ? Json(kMmPerMetre * result.point_sd_m) : Json(nullptr)},
      {"target_size_ratio", {{"value", result.size_ratio}, {"sd", result.size_ratio_sd}}},
      {"lens", found && options.free_lens ? LensJson(result) : Json(nullptr)},
      {"joint_offsets", offsets},
      {"noise", {{"corner_px", result.sigma_px}, {"robot_mm", kMmPerMetre * result.robot_m}}},
      {"rms_px", result.rms_px},
      {"second_turn_deg", result.second_axis_rad / kRadPerDeg},
      {"held_out",
       {{"linear", ErrorJson(result.linear)}, {"adjusted", ErrorJson(result.adjusted)}}},
      {"images_used", result.used},
      {"images_refused", refused},
  };
  if (X_WB != nullptr && to_hand && found) {
    const Pose X_WC = *X_WB * result.camera.X;
    root["measurement"] = {
        {"camera_xyz_mm", JsonOfVector(kMmPerMetre * X_WC.p)},
        {"camera_rpy_deg", JsonOfVector(RollPitchYawFromRotation(X_WC.R) / kRadPerDeg)}};
  }
  return text::JsonText(root, 2) + "\n";
}

/// Empty if a refused fit was not evaluated on held-out images.
std::string HeldOutText(const HandEye& result) {
  if (result.adjusted.rms_px == 0) return "";
  return fmt::format(
      "  error on held-out images: {:.2f} px and {:.2f} mm ({:.2f} px and {:.2f} mm by the linear "
      "method)\n",
      result.adjusted.rms_px, kMmPerMetre * result.adjusted.position_m, result.linear.rms_px,
      kMmPerMetre * result.linear.position_m);
}

std::string HandEyeText(const HandEye& result, const HandEyeOptions& options) {
  const bool to_hand = options.setup == HandEyeSetup::kEyeToHand;
  std::string text = result.accepted ? "accepted\n" : "refused\n";
  for (const std::string& reason : result.reasons) text += "  " + reason + "\n";
  if (IsSet(result.camera)) {
    text += PoseLine("camera", to_hand ? "base" : "flange", result.camera);
    text += PoseLine("target", to_hand ? "flange" : "base", result.target);
    const int ratio = text::DecimalsFor({result.size_ratio_sd}, 4);
    text += fmt::format(
        "  standard deviation of a point that the camera sees: {:.{}f} mm\n"
        "{}  noise: corners {:.3f} px, robot {:.3f} mm; target size {:.{}f} +- {:.{}f} times the "
        "declared one\n",
        kMmPerMetre * result.point_sd_m, text::DecimalsFor({kMmPerMetre * result.point_sd_m}, 3),
        HeldOutText(result), result.sigma_px, kMmPerMetre * result.robot_m, result.size_ratio,
        ratio, result.size_ratio_sd, ratio);
  }
  text += fmt::format("  {} images used, {} refused\n", result.used.size(), result.refused.size());
  for (const RefusedView& view : result.refused)
    text += fmt::format("    {}: {}\n", view.name, view.reason);
  return text;
}

}  // namespace plumbline::vision
