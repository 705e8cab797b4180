// Fuzzer: no register image crashes the search for a decoding, and what it decides decodes the
// image to finite joints within the arm's limits.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "drivers/robot/decoding_search.h"
#include "firmware-like/geometry/units.h"

namespace {

using plumbline::robot::DecodingEvidence;
using plumbline::robot::RegisterImage;

plumbline::kinematics::Chain Arm(int joints, bool slide) {
  plumbline::model::Robot robot;
  for (int j = 0; j < joints; ++j) {
    plumbline::model::Joint joint;
    joint.a_m = 0.1 * j;
    joint.d_m = 0.2;
    joint.alpha_rad = j % 2 == 0 ? 1.5 : -1.5;
    if (slide && j == 0) joint.type = plumbline::model::JointType::kPrismatic;
    joint.min = -3;
    joint.max = 3;
    robot.joints.push_back(joint);
  }
  return plumbline::kinematics::Chain(robot);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 4) return 0;
  const auto chain = Arm(1 + data[0] % 7, (data[0] & 0x80) != 0);
  const int images = 1 + data[1] % 3;
  DecodingEvidence evidence;
  evidence.tools.resize(data[1] / 128);
  evidence.moving = (data[1] & 0x40) != 0;
  const std::size_t words = std::min<std::size_t>((size - 4) / 2 / images, 60);
  for (int k = 0; k < images; ++k) {
    RegisterImage image;
    for (std::size_t w = 0; w < words; ++w) {
      const std::size_t at = 4 + 2 * (k * words + w);
      if (data[at] == 0x5A) continue;  // a hole
      image.words[(data[2] << 8) % 65500 + static_cast<int>(w)] =
          static_cast<std::uint16_t>(data[at] << 8 | data[at + 1]);
    }
    evidence.images.push_back(image);
  }
  if ((data[3] & 1) != 0) {
    plumbline::robot::PendantValues shown;
    shown.q = plumbline::model::JointVector::Constant(chain.size(), 0.01 * data[3]);
    shown.tolerance = 0.5;
    evidence.pendant.push_back(shown);
  }
  if ((data[3] & 2) != 0) {
    for (int k = 0; k + 1 < images; ++k)
      evidence.moves.push_back({static_cast<std::size_t>(k), k % chain.size(), 0.2});
  }
  const auto verdict = plumbline::robot::SearchDecoding(chain, evidence);
  if (verdict.state == plumbline::robot::DecodingVerdict::State::kDecided) {
    for (const auto& image : evidence.images) {
      const auto q = plumbline::robot::Decoded(verdict.candidates.front().joints, chain, image);
      if (!q || !q->allFinite()) std::abort();
    }
    if (!chain.WithinLimits(verdict.candidates.front().q, 0.03)) std::abort();
  }
  plumbline::robot::RobotProfile profile;
  for (int j = 0; j < chain.size(); ++j) {
    plumbline::robot::JointSignal joint;
    joint.value.address = (data[2] << 8) % 65500 + 2 * j;
    joint.value.type = plumbline::robot::RegisterType::kFloat32;
    joint.value.scale = plumbline::kRadPerDeg;
    profile.joints.push_back(joint);
  }
  static_cast<void>(
      plumbline::robot::RemediesOf(profile, chain, evidence.images.front(), evidence.tools));
  return 0;
}
