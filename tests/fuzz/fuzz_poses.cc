// Fuzzer: arbitrary bytes as the robot poses of a hand-eye calibration: poses, or faults.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "app/vision/hand_eye/robot_poses.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  std::vector<plumbline::model::Joint> joints(data[0] % 4);
  if (joints.size() > 1) joints[1].type = plumbline::model::JointType::kPrismatic;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  plumbline::config::FaultList faults;
  const auto poses = plumbline::vision::RobotPosesFromCsv(text, "poses.csv", joints, faults);
  if (poses.has_value() == faults.HasFaults()) std::abort();
  if (!poses) return 0;
  for (const auto& [image, pose] : *poses) {
    const auto count = static_cast<std::size_t>(pose.q.size());
    if (image.empty() || (count != 0 && count != joints.size())) std::abort();
    if (!pose.q.allFinite() || !pose.X_BF.p.allFinite()) std::abort();
    if (!pose.X_BF.R.isUnitary(1e-9) || pose.X_BF.R.determinant() < 0) std::abort();
  }
  return 0;
}
