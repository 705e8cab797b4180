// Options shared by import-urdf and export-urdf: the ends of the chain.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "app/measure/urdf/joint_chain.h"

namespace plumbline::cli {

struct ChainEnds {
  std::string base, tip;
  bool apply_rising = false;

  measure::Rising rising() const {
    return apply_rising ? measure::Rising::kAddedToReading : measure::Rising::kIgnored;
  }
};

inline void AddChainEnds(CLI::App& command, ChainEnds& ends) {
  command.add_option("--base", ends.base,
                     "Link at which the chain starts; default: the root of the tree with the tip");
  command.add_option("--tip", ends.tip,
                     "Link that becomes the flange; default: tool0, else the only end of the "
                     "longest chain");
  command.add_flag("--apply-rising", ends.apply_rising,
                   "Add <calibration rising> to the joint readings; robot_calibration writes its "
                   "joint offsets there");
}

}  // namespace plumbline::cli
