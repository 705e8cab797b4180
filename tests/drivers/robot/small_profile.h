// Small profile for device tests: two joints in one block, and push slots at 100.
#pragma once

#include "drivers/robot/profile.h"

namespace plumbline::robot {

inline RegisterValue ValueAt(int address, RegisterType type, double scale) {
  RegisterValue value;
  value.address = address;
  value.type = type;
  value.scale = scale;
  return value;
}

/// Holding 0 and 1: joints in mrad, int16. Nothing else is read.
inline RobotProfile SmallProfile() {
  RobotProfile profile;
  profile.name = "small";
  profile.blocks = {{RegisterTable::kHolding, 0, 4}};
  for (int i = 0; i < 2; ++i) {
    profile.joints.push_back({ValueAt(i, RegisterType::kInt16, 1e-3), JointWrap::kNone, {}});
  }
  PushProfile push;
  push.first = 100;
  push.slots = 3;
  push.stride = 8;
  push.id_place = 0;
  push.pose_place = 1;
  push.sequence_place = 7;
  profile.push = push;
  return profile;
}

}  // namespace plumbline::robot
