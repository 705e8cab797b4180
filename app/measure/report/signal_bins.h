// Residual against a signal: points in the order of the signal, and their means over bins.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// A signal's values with one component of the residual [mm], sorted by value.
struct Cloud {
  std::vector<double> value, before, after;
};

struct Bin {
  double value = 0, before = 0, after = 0;
  int count = 0;
  bool after_gap = false;  ///< the values have a gap before this bin
};

/// Means over bins of equal count along the signal. Equal values share a bin, and no bin spans a
/// gap in the values.
std::vector<Bin> BinsOf(const Cloud& cloud);

/// Variance of the residual, and the share of it that binned means explain, both corrected for the
/// degrees of freedom.
std::pair<double, double> ExplainedBy(const std::vector<Bin>& bins, double Bin::*mean,
                                      const std::vector<double>& residual);

/// The residual along the axis of W that depends on a signal most, and the shares of it that binned
/// means explain. Outliers are left out.
struct Dependence {
  const SignalTrace* signal;
  int axis = 2;
  Cloud cloud;
  double share_before = 0, share_after = 0;

  /// "< 0.001", "= 0.2": probability that pure noise would depend on the signal at least as
  /// strongly as the residual after correction.
  std::string PText() const;
};

/// One for each signal, the strongest remaining dependence first.
std::vector<Dependence> DependencesOf(const Diagnosis& diagnosis);

}  // namespace plumbline::measure
