// The motion responder as a client on the hostile wire, with a cell whose corrections change.
#pragma once

#include <arpa/inet.h>

#include <random>
#include <string>
#include <vector>

#include "drivers/motion/motion_responder.h"
#include "firmware-like/geometry/units.h"
#include "tests/firmware-like/test_cell.h"
#include "tests/motion_robots/hostile_wire.h"

namespace plumbline::test {

/// An arm whose load bends it by tenths of a millimetre.
inline model::CellModel StiffArm() {
  model::CellModel cell = HeavyArm();
  for (model::Joint& joint : cell.robot.joints) *joint.compliance_rad_per_Nm *= 0.1;
  cell.tool.rigid = true;
  return cell;
}

inline motion_link::MotionSettings VirtualSettings(const std::string& kind, bool holds_last) {
  motion_link::MotionSettings settings;
  settings.enabled = true;
  settings.kind = kind;
  settings.robot = "192.0.2.7";
  settings.limits.cycle_s = 0.004;
  settings.limits.timeout_s = 0.04;
  settings.limits.rate_m_per_s = 0.01;
  settings.limits.max_jump_m = 0.0005;
  settings.limits.max_translation_m = holds_last ? 0.003 : 0.0005;
  settings.limits.holds_last = holds_last;
  settings.limits.ramp_s = 0.2;
  settings.rules.widest_radius_m = 0.001;
  if (kind == "rsi") {
    settings.rules.rotates = true;
    settings.limits.max_jump_rad = 0.002;
    settings.limits.max_rotation_rad = holds_last ? 0.012 : 0.002;
  }
  if (kind == "egm") settings.rules.frame = motion_offset::OffsetFrame::kTool;
  return settings;
}

class VirtualClient final : public motion_robots::Client {
 public:
  explicit VirtualClient(const motion_link::MotionSettings& settings)
      : settings_(settings),
        responder_(motion_link::MotionResponder::Create(settings, 0).value()),
        model_{1, {StiffArm(), {}}} {
    inet_pton(AF_INET, settings.robot.c_str(), &robot_);
    report_.generation = 1;
    report_.enabled = report_.plc_alive = report_.robot_trusted = true;
    report_.payload = loads::Payload{60, Vec3(0.02, 0.05, 1.1)};
    report_.radius = {0.0003, model::RadiusBasis::kMeasured};
  }

  std::vector<std::string> Receive(const std::vector<Datagram>& datagrams, double now_s) override {
    for (const Datagram& datagram : datagrams) {
      const std::uint32_t from = datagram.foreign ? robot_ + 1 : robot_;
      responder_.Take(from, datagram.bytes, now_s);
    }
    report_.now_s = now_s;
    report_.q_s = now_s - 0.1;  // a slow robot link
    std::array<char, 512> answer{};
    const std::size_t size = responder_.Answer(report_, &model_, false, answer);
    if (size == 0) return {};
    return {{answer.data(), size}};
  }
  void Idle(double now_s) override { responder_.Idle(now_s); }
  void Restart(double now_s) override {
    responder_ = motion_link::MotionResponder::Create(settings_, now_s).value();
  }
  void Disturb(std::mt19937& random) override {
    const auto chance = [&random](double p) { return std::bernoulli_distribution(p)(random); };
    report_.enabled = chance(0.8);
    report_.robot_trusted = chance(0.8);
    report_.radius.radius_m = chance(0.9) ? 0.0003 : 0.002;
    report_.payload->mass_kg = std::uniform_real_distribution(0.0, 120.0)(random);
  }
  /// The robot link's reading of the same joints.
  void SetJoints(const std::vector<double>& joints_deg) {
    report_.q.resize(static_cast<Eigen::Index>(joints_deg.size()));
    for (std::size_t k = 0; k < joints_deg.size(); ++k) {
      report_.q[static_cast<Eigen::Index>(k)] = kRadPerDeg * joints_deg[k];
    }
  }
  const motion_link::MotionResponder& responder() const { return responder_; }
  motion_offset::CycleReport& report() { return report_; }

 private:
  motion_link::MotionSettings settings_;
  motion_link::MotionResponder responder_;
  motion_offset::MotionModel model_;
  motion_offset::CycleReport report_;
  std::uint32_t robot_ = 0;
};

}  // namespace plumbline::test
