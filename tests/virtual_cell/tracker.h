// Measuring instrument: a laser tracker with reflectors at the tool tip.
#pragma once

#include <random>
#include <vector>

#include "tests/virtual_cell/register_bank.h"
#include "tests/virtual_cell/world.h"

namespace virtual_cell {

/// Registers: 0-5 tip in W [mm], 6-11 rotation vector of the tip in W [rad], 12 counter,
/// 13 at rest (1), 14-15 time [s], 16-39 four reflectors in W [mm], 40-41 payload actually
/// carried [kg]; all numbers float32 ABCD.
class Tracker {
 public:
  /// @param noise_of_standstill  one error per standstill, drawn from the seed and the number of
  ///                             the standstill, so that a run does not depend on the number of
  ///                             measurements taken
  Tracker(double noise_mm, std::vector<Vec3> reflectors_T, bool noise_of_standstill = false,
          unsigned seed = 1);

  /// Takes one measurement with independent noise per axis and point.
  void Measure(const Truth& truth, const WorldInputs& now, bool at_rest);
  RegisterBank& bank() { return bank_; }

 private:
  void SetPoint(int at, const Vec3& p_W);

  double noise_mm_;
  std::vector<Vec3> reflectors_T_;
  bool noise_of_standstill_;
  unsigned seed_;
  unsigned standstills_ = 0;
  bool at_rest_ = false;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  RegisterBank bank_{64};
  int counter_ = 0;
};

}  // namespace virtual_cell
