// What a data set may hide.
#pragma once

#include "tests/simulator/design.h"

namespace simulator {

struct Hidden {
  std::string family;
  Effects effects;
  bool in_catalogue = true;
  std::vector<std::string> drivers;  ///< recorded signals that an effect outside follows
  bool rigid_declared = false;       ///< the cell file omits the joints' compliance
};

/// Names of all families but `A+B@q2,q3+..`, which hides any effects of the catalogue at once, with
/// the joints given, if any.
std::vector<std::string> Families();

bool NeedsVelocities(const std::string& family);
bool NeedsCamera(const std::string& family);
bool NeedsTilt(const std::string& family);
bool NeedsUnknownMasses(const std::string& family);
bool NeedsRange(const std::string& family);
bool NeedsPressure(const std::string& family);

/// A family with random joints and parameters, not yet scaled.
/// @throws std::runtime_error for an unknown name
Hidden DrawFamily(const std::string& family, const Cell& cell, Generator& random);

/// RMS of what the effects change in the readings over sigma, an axis.
double Signal(const Cell& cell, const Effects& effects, const std::vector<Row>& rows);

/// Scales the sizes of each effect alone (not its cycles, phases or times) to the asked signal.
void ScaleTo(double signal, const Cell& cell, const std::vector<Row>& rows, Effects& effects);

}  // namespace simulator
