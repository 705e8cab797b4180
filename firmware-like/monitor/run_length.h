// How long the monitor runs between false alarms, and the threshold for a wanted rate of them.
#pragma once

#include <functional>

#include "firmware-like/monitor/drift_monitor.h"

namespace plumbline {

/// What the cell wants of its monitor.
struct MonitorWish {
  double sigma_m = 5e-5;         ///< scatter of one probe, one axis
  double shift_m = 3e-4;         ///< change that shall be found quickly
  double probes_per_day = 1440;  ///< decides how many false chances a year has
  double false_alarms_per_year = 1;
  int reference_probes = 0;     ///< 0: the reference is the model
  double reference_sd_m = 0;    ///< of 0: standard deviation of the model's own mean residual
  double outlier_share = 0.05;  ///< probes expected to be wild, in either sense
};

/// Mean number of probes until one cumulative sum passes its threshold while nothing changes.
/// Markov chain over a grid of sums [D. Brook and D. A. Evans, Biometrika 59 (1972) 539]:
///   ARL = first entry of (I - Q)^-1 1
/// for increments clip(e + n) - allowance, n standard normal, and with `outlier_share` +-clip.
/// @param offset  e: error of the reference along this direction [sigma]
/// Allocates; not for the cycle. About 1 ms.
double MeanRunLength(const MonitorDesign& design, double offset, double outlier_share);

/// The design that meets the wish: allowance = half the shift, within 0.25..1 sigma, and the
/// smallest threshold (to 0.1 %) for which
///   E over the error of the reference [exp(-probes in a year * sum over directions 1/ARL)]
///     >= exp(-false_alarms_per_year).
/// Directions overlap, so that the sum counts some alarms twice: the true rate is lower. With the
/// reference estimated from N probes its error has 1/sqrt(N) sigma in each coordinate, and a little
/// more for the wild ones.
/// Allocates; takes some tenths of a second.
/// @param step  called between its steps, of which each takes about 20 ms
MonitorDesign MonitorDesignFor(
    const MonitorWish& wish, const std::function<void()>& step = [] {});

}  // namespace plumbline
