#include "tests/virtual_ur/virtual_ur.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace virtual_ur {
namespace {

std::array<double, 6> SixOf(const virtual_cell::Vec3& a, const virtual_cell::Vec3& b) {
  return {a.x(), a.y(), a.z(), b.x(), b.y(), b.z()};
}

}  // namespace

VirtualUr::VirtualUr(virtual_cell::World world, virtual_cell::MotionProgram program,
                     const virtual_cell::VirtualCellOptions& options, int rtde_port)
    : cell_(std::move(world), std::move(program), options),
      rtde_(rtde_port, options.address),
      next_s_(MonotonicNow()) {
  if (cell_.controller().q().size() != 6) throw std::runtime_error("an RTDE robot has six joints");
  Report();
}

void VirtualUr::Step() {
  next_s_ = std::max(next_s_ + RtdeServer::kCycle_s, MonotonicNow() - 0.1);
  rtde_.Serve(next_s_);
  cell_.Step(MonotonicNow(), 0);
  Report();
  rtde_.Advance();
}

void VirtualUr::Report() {
  const virtual_cell::Controller& controller = cell_.controller();
  UrState& state = rtde_.state();
  for (int j = 0; j < 6; ++j) state.actual_q[static_cast<std::size_t>(j)] = controller.q()[j];
  const virtual_cell::Motion tip = controller.NominalTipPose();
  state.tcp_pose = SixOf(tip.translation(), virtual_cell::VectorFromRotation(tip.linear()));
  state.tcp_offset = SixOf(controller.cell().tip_F, virtual_cell::Vec3::Zero());
  state.payload = controller.payload_kg();
  const virtual_cell::Vec3& cog = controller.cell().payload_cog_F;
  state.payload_cog = {cog.x(), cog.y(), cog.z()};
  state.joint_temperatures.fill(controller.cell().reference_temperature_C);
}

std::string VirtualUr::Execute(const std::string& line) {
  constexpr std::string_view kFault = "fault ";
  if (line.rfind(kFault, 0) != 0) return cell_.Execute(line);
  const std::string wrong = rtde_.SetFault(line.substr(kFault.size()));
  return wrong.empty() ? "ok" : "error: " + wrong;
}

}  // namespace virtual_ur
