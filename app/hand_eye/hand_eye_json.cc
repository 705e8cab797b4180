#include "app/hand_eye/hand_eye_json.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/lens/lens_model.h"
#include "app/printed_digits.h"
#include "app/tracking/pose_json.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline {
namespace {

using Json = nlohmann::ordered_json;

bool Found(const FoundPose& pose) {
  return pose.covariance.trace() > 0;
}

Json PoseJson(const FoundPose& pose, const char* frame) {
  if (!Found(pose)) return nullptr;
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

Json LensJson(const HandEye& answer) {
  const Lens& lens = answer.lens.lens;
  Json sds;
  for (int k = 0; k < kLensCount; ++k)
    sds[kLensNames[k]] = std::sqrt(std::max(0.0, answer.lens.covariance(k, k)));
  return {{"fx", lens.fx},
          {"fy", lens.fy},
          {"cx", lens.cx},
          {"cy", lens.cy},
          {"distortion", {lens.k1, lens.k2, lens.p1, lens.p2, lens.k3}},
          {"sd", sds}};
}

std::string PoseLine(const char* what, const char* frame, const FoundPose& pose) {
  const Vec3 p = kMmPerMetre * pose.X.p, rpy = RollPitchYawFromRotation(pose.X.R) / kRadPerDeg;
  const Vec6 sd = pose.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Vec3 p_sd = kMmPerMetre * sd.head<3>();
  const double turn_sd = sd.tail<3>().norm() / kRadPerDeg;
  const int mm = DecimalsFor({p_sd.x(), p_sd.y(), p_sd.z()}, 2), deg = DecimalsFor({turn_sd}, 3);
  return fmt::format(
      "  {} in the {}: {:.{}f}, {:.{}f}, {:.{}f} mm (+- {:.{}f}, {:.{}f}, {:.{}f}); roll, pitch, "
      "yaw {:.{}f}, {:.{}f}, {:.{}f} deg (+- {:.{}f})\n",
      what, frame, p.x(), mm, p.y(), mm, p.z(), mm, p_sd.x(), mm, p_sd.y(), mm, p_sd.z(), mm,
      rpy.x(), deg, rpy.y(), deg, rpy.z(), deg, turn_sd, deg);
}

}  // namespace

std::string HandEyeJson(const HandEye& answer, const HandEyeOptions& options, const Pose* X_WB) {
  const bool to_hand = options.setup == HandEyeSetup::kEyeToHand;
  const bool found = Found(answer.camera);
  Json refused = Json::array(), offsets = Json::array();
  for (const RefusedView& view : answer.refused)
    refused.push_back({{"name", view.name}, {"reason", view.reason}});
  for (Eigen::Index i = 0; i < answer.joint_offsets.size(); ++i) {
    if (answer.joint_offset_sds[i] <= 0) continue;
    offsets.push_back({{"name", fmt::format("q{}", i + 1)},
                       {"value", answer.joint_offsets[i]},
                       {"sd", answer.joint_offset_sds[i]},
                       {"unit", "rad"}});
  }
  Json root = {
      {"schema", 1},
      {"accepted", answer.accepted},
      {"reasons", answer.reasons},
      {"setup", to_hand ? "eye-to-hand" : "eye-in-hand"},
      {"camera", PoseJson(answer.camera, to_hand ? "base" : "flange")},
      {"target", PoseJson(answer.target, to_hand ? "flange" : "base")},
      {"point_sd_mm", found ? Json(kMmPerMetre * answer.point_sd_m) : Json(nullptr)},
      {"target_size_ratio", {{"value", answer.size_ratio}, {"sd", answer.size_ratio_sd}}},
      {"lens", found && options.free_lens ? LensJson(answer) : Json(nullptr)},
      {"joint_offsets", offsets},
      {"noise", {{"corner_px", answer.sigma_px}, {"robot_mm", kMmPerMetre * answer.robot_m}}},
      {"rms_px", answer.rms_px},
      {"second_turn_deg", answer.second_turn_rad / kRadPerDeg},
      {"held_out",
       {{"linear", ErrorJson(answer.linear)}, {"adjusted", ErrorJson(answer.adjusted)}}},
      {"images_used", answer.used},
      {"images_refused", refused},
  };
  if (X_WB != nullptr && to_hand && found) {
    const Pose X_WC = *X_WB * answer.camera.X;
    root["measurement"] = {
        {"camera_xyz_mm", JsonOfVector(kMmPerMetre * X_WC.p)},
        {"camera_rpy_deg", JsonOfVector(RollPitchYawFromRotation(X_WC.R) / kRadPerDeg)}};
  }
  return root.dump(2) + "\n";
}

std::string HandEyeText(const HandEye& answer, const HandEyeOptions& options) {
  const bool to_hand = options.setup == HandEyeSetup::kEyeToHand;
  std::string text = answer.accepted ? "accepted\n" : "refused\n";
  for (const std::string& reason : answer.reasons) text += "  " + reason + "\n";
  if (Found(answer.camera)) {
    text += PoseLine("camera", to_hand ? "base" : "flange", answer.camera);
    text += PoseLine("target", to_hand ? "flange" : "base", answer.target);
    const int ratio = DecimalsFor({answer.size_ratio_sd}, 4);
    text += fmt::format(
        "  a point that the camera sees is known to {:.{}f} mm (one deviation)\n"
        "  images that took no part: {:.2f} px and {:.2f} mm off ({:.2f} px and {:.2f} mm by the "
        "linear method)\n"
        "  noise: corners {:.3f} px, robot {:.3f} mm; the target is {:.{}f} +- {:.{}f} of its told "
        "size\n",
        kMmPerMetre * answer.point_sd_m, DecimalsFor({kMmPerMetre * answer.point_sd_m}, 3),
        answer.adjusted.rms_px, kMmPerMetre * answer.adjusted.position_m, answer.linear.rms_px,
        kMmPerMetre * answer.linear.position_m, answer.sigma_px, kMmPerMetre * answer.robot_m,
        answer.size_ratio, ratio, answer.size_ratio_sd, ratio);
  }
  text += fmt::format("  {} images used, {} refused\n", answer.used.size(), answer.refused.size());
  for (const RefusedView& view : answer.refused)
    text += fmt::format("    {}: {}\n", view.name, view.reason);
  return text;
}

}  // namespace plumbline
