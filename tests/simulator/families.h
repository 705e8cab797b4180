// Families of hidden effects.
#pragma once

#include "tests/simulator/design.h"

namespace simulator {

struct Hidden {
  std::string family;
  Effects effects;
  bool in_catalogue = true;
  std::vector<std::string> drivers;  ///< recorded signals that an uncatalogued effect follows
  bool rigid_declared = false;       ///< the cell file omits joint compliance
};

/// Names of all families except `A+B@q2,q3+..`, which combines any effects of the catalogue,
/// optionally with given joints.
std::vector<std::string> Families();

bool NeedsVelocities(const std::string& family);
bool NeedsCamera(const std::string& family);
bool NeedsTilt(const std::string& family);
bool NeedsUnknownMasses(const std::string& family);
bool NeedsRange(const std::string& family);
bool NeedsPressure(const std::string& family);

/// Draws a family with random joints and parameters, not scaled yet.
/// @throws std::runtime_error for an unknown name
Hidden DrawFamily(const std::string& family, const Cell& cell, Generator& random);

/// RMS change of the readings due to the effects, per axis, divided by sigma.
double Signal(const Cell& cell, const Effects& effects, const std::vector<Row>& rows);

/// Scales the sizes of each effect individually (not its cycles, phases or times) to the given
/// signal.
void ScaleTo(double signal, const Cell& cell, const std::vector<Row>& rows, Effects& effects);

}  // namespace simulator
