// Load used by the model, and which of its properties were stated.
#pragma once

#include <optional>

#include "firmware-like/loads/gravity.h"

namespace plumbline::deflection {

struct LoadStatement {
  loads::Payload modelled;        ///< used by the model
  std::optional<double> mass_kg;  ///< stated by the robot, the configuration or a table
  bool centre_stated = false;     ///< the centre of gravity was stated

  /// A payload whose mass and centre of gravity were both stated.
  static LoadStatement Stated(const loads::Payload& payload) {
    return {payload, payload.mass_kg, payload.mass_kg > 0};
  }
};

}  // namespace plumbline::deflection
