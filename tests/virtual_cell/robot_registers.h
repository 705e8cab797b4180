// Register interface of the controller: two profiles, each with a command block and slots
// for pushed points. README.md documents the registers.
#pragma once

#include <string>

#include "tests/virtual_cell/controller.h"
#include "tests/virtual_cell/register_bank.h"

namespace virtual_cell {

enum class Profile { kUr, kGeneric };

/// State reported by the controller, including injected faults.
struct ReportedState {
  Joints q, speed;                   ///< [rad], [rad/s]
  Vec3 tip_B = Vec3::Zero();         ///< nominal tool tip [m]
  Vec3 tip_rotation = Vec3::Zero();  ///< rotation vector [rad]
  Vec3 tcp_offset_F = Vec3::Zero();
  double payload_kg = 0;
  Vec3 payload_cog_F = Vec3::Zero();
  int tool_number = 0;
  double temperature_C = 22;
  bool moving = false;
  int sequence = 0;  ///< counts the controller's cycles
};

/// Addresses that differ between the profiles.
struct RegisterLayout {
  int size;                   ///< registers served, from 0
  int first_open, last_open;  ///< the range clients may write
  int command;                ///< first register of the command block
  int pushed;                 ///< first register of the slots of pushed points
  int pushed_slots;
};
RegisterLayout LayoutOf(Profile profile);

void WriteState(Profile profile, const ReportedState& state, RegisterBank& bank);

/// Offsets in the command block. The client writes the sequence last.
enum CommandOffset : int {
  kTarget = 0,  ///< six float32: x, y, z [mm], rotation vector [rad], tip in base frame
  kCode = 12,
  kParameter = 13,  ///< of kMoveToPushed: the point's id
  kSequence = 14,
  kEcho = 15,  ///< sequence of the command last taken
  kBusy = 16,
  kDone = 17,  ///< 1 if that command succeeded
  kFault = 18,
};
enum CommandCode : int { kMove = 1, kAttach = 2, kRelease = 3, kMoveToPushed = 4, kGoHome = 5 };
enum CommandFault : int {
  kNoFault = 0,
  kFaultUnreachable = 1,
  kFaultOutsideLimits = 2,
  kFaultUnknownCode = 3,
  kFaultNoSuchPoint = 4,
  kFaultProgramRuns = 5,
};

/// Offsets in one slot of a pushed point: id, x, y, z [0.1 mm], rotation vector [mrad], sequence
/// (0: not valid).
inline constexpr int kSlotSize = 8;

/// Executes commands that clients write to the command block.
class CommandBlock {
 public:
  CommandBlock(Profile profile, const MotionProgram& program)
      : layout_(LayoutOf(profile)), program_(program) {}

  /// @param remote  false while a program runs; every command is then refused
  void Serve(bool remote, Controller& controller, RegisterBank& bank);

 private:
  CommandFault Execute(int code, Controller& controller, const RegisterBank& bank) const;

  RegisterLayout layout_;
  const MotionProgram& program_;
  int taken_ = 0;
  bool under_way_ = false;
};

}  // namespace virtual_cell
