#include "tests/virtual_cell/robot_registers.h"

#include <cmath>
#include <numbers>

namespace virtual_cell {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

void WriteUr(const ReportedState& state, RegisterBank& bank) {
  const int joints = static_cast<int>(std::min<Eigen::Index>(state.q.size(), 7));
  bank.SetWord(256, 3);
  bank.SetWord(257, 0);
  bank.SetWord(258, 7);  // robot mode: running
  bank.SetWord(260, 1);  // power on
  for (int i = 0; i < std::min(joints, 6); ++i) {
    const double q = state.q[i];
    // Angle modulo one turn, unsigned, and the revolution: 0, or 65535 for -1.
    const double turns = std::floor(q / kTurn);
    bank.SetWord(270 + i, static_cast<int>(std::lround((q - turns * kTurn) * 1e3)));
    bank.SetWord(320 + i, static_cast<int>(turns));
    bank.SetSigned(280 + i, state.speed[i] * 1e3);
    bank.SetSigned(300 + i, state.temperature_C);
  }
  for (int k = 0; k < 3; ++k) {
    bank.SetSigned(400 + k, state.tip_B[k] * 1e4);
    bank.SetSigned(403 + k, state.tip_rotation[k] * 1e3);
    bank.SetSigned(420 + k, state.tcp_offset_F[k] * 1e4);
    bank.SetWord(423 + k, 0);
  }
  bank.SetSigned(769, state.temperature_C);

  // Values that a robot program copies into the general-purpose registers.
  bank.SetWord(140, static_cast<int>(std::lround(state.payload_kg * 100)));
  for (int k = 0; k < 3; ++k) bank.SetSigned(141 + k, state.payload_cog_F[k] * 1e4);
  bank.SetWord(144, state.tool_number);
  bank.SetWord(145, state.sequence);
  for (int i = 0; i < joints; ++i) {
    const double microradians = state.q[i] * 1e6;
    const bool fits = std::isfinite(microradians) && std::abs(microradians) < 2147483647.0;
    const auto value = fits ? static_cast<std::int32_t>(std::lround(microradians)) : INT32_MIN;
    bank.SetLong(150 + 2 * i, static_cast<std::uint32_t>(value));
  }
}

void WriteGeneric(const ReportedState& state, RegisterBank& bank) {
  const int joints = static_cast<int>(std::min<Eigen::Index>(state.q.size(), 8));
  for (int i = 0; i < joints; ++i) {
    bank.SetFloat(2 * i, state.q[i]);
    bank.SetFloat(42 + 2 * i, state.speed[i]);
  }
  for (int k = 0; k < 3; ++k) {
    bank.SetFloat(16 + 2 * k, state.tip_B[k]);
    bank.SetFloat(22 + 2 * k, state.tip_rotation[k]);
    bank.SetFloat(30 + 2 * k, state.payload_cog_F[k]);
  }
  bank.SetFloat(28, state.payload_kg);
  bank.SetFloat(36, state.temperature_C);
  bank.SetWord(38, state.moving ? 2 : 1);
  bank.SetWord(39, state.sequence);
  bank.SetWord(40, state.tool_number);
  bank.SetWord(41, joints);
}

Vec3 FloatVector(const RegisterBank& bank, int at) {
  return {bank.Float(at), bank.Float(at + 2), bank.Float(at + 4)};
}

double Signed(const RegisterBank& bank, int at) {
  return static_cast<std::int16_t>(bank.Word(at));
}

}  // namespace

RegisterLayout LayoutOf(Profile profile) {
  if (profile == Profile::kUr) {
    return {.size = 800,
            .first_open = 128,
            .last_open = 255,
            .command = 170,
            .pushed = 200,
            .pushed_slots = 6};
  }
  return {.size = 400,
          .first_open = 200,
          .last_open = 399,
          .command = 200,
          .pushed = 300,
          .pushed_slots = 12};
}

void WriteState(Profile profile, const ReportedState& state, RegisterBank& bank) {
  if (profile == Profile::kUr) {
    WriteUr(state, bank);
  } else {
    WriteGeneric(state, bank);
  }
}

CommandFault CommandBlock::Execute(int code, Controller& controller,
                                   const RegisterBank& bank) const {
  MoveAnswer answer = MoveAnswer::kAccepted;
  const int base = layout_.command;
  if (code == kAttach) {
    controller.AttachPayload(program_.payload_kg);
  } else if (code == kRelease) {
    controller.ReleasePayload();
  } else if (code == kGoHome) {
    answer = controller.MoveToJoints(program_.home);
  } else if (code == kMove) {
    answer = controller.MoveToPose(MotionFromXyzVector(FloatVector(bank, base + kTarget) * 1e-3,
                                                       FloatVector(bank, base + kTarget + 6)));
  } else if (code == kMoveToPushed) {
    const int id = bank.Word(base + kParameter);
    int slot = 0;
    while (slot < layout_.pushed_slots && bank.Word(layout_.pushed + slot * kSlotSize) != id) {
      ++slot;
    }
    if (id == 0 || slot == layout_.pushed_slots) return kFaultNoSuchPoint;
    const int at = layout_.pushed + slot * kSlotSize;
    if (bank.Word(at + 7) == 0) return kFaultNoSuchPoint;  // sequence 0: not valid
    const Vec3 p(Signed(bank, at + 1), Signed(bank, at + 2), Signed(bank, at + 3));
    const Vec3 r(Signed(bank, at + 4), Signed(bank, at + 5), Signed(bank, at + 6));
    answer = controller.MoveToPose(MotionFromXyzVector(p * 1e-4, r * 1e-3));
  } else {
    return kFaultUnknownCode;
  }
  if (answer == MoveAnswer::kUnreachable) return kFaultUnreachable;
  return answer == MoveAnswer::kOutsideLimits ? kFaultOutsideLimits : kNoFault;
}

void CommandBlock::Serve(bool remote, Controller& controller, RegisterBank& bank) {
  const int base = layout_.command;
  const int sequence = bank.Word(base + kSequence);
  if (sequence != taken_) {
    taken_ = sequence;
    const CommandFault fault =
        remote ? Execute(bank.Word(base + kCode), controller, bank) : kFaultProgramRuns;
    under_way_ = fault == kNoFault;
    bank.SetWord(base + kFault, fault);
    bank.SetWord(base + kDone, 0);
  }
  const bool busy = under_way_ && controller.Moving();
  if (under_way_ && !busy) {
    under_way_ = false;
    bank.SetWord(base + kDone, 1);
  }
  bank.SetWord(base + kBusy, busy ? 1 : 0);
  bank.SetWord(base + kEcho, taken_);
}

}  // namespace virtual_cell
