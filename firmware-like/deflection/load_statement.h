// What is known of the load that a tip is computed for.
#pragma once

#include <optional>

#include "firmware-like/loads/gravity.h"

namespace plumbline {

/// The load of the model beside what somebody stated of the real one.
struct LoadStatement {
  Payload modelled;               ///< what the model computes with
  std::optional<double> mass_kg;  ///< as the robot, the configuration or a table states it
  bool centre_stated = false;

  /// A payload whose mass and centre were both stated.
  static LoadStatement Stated(const Payload& payload) {
    return {payload, payload.mass_kg, payload.mass_kg > 0};
  }
};

}  // namespace plumbline
