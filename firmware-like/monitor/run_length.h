// Design of the drift monitor: run length between false alarms, and threshold for a required rate.
#pragma once

#include <functional>

#include "firmware-like/monitor/drift_monitor.h"

namespace plumbline::monitor {

/// Requirements on the drift monitor of a cell.
struct MonitorRequirements {
  double sigma_m = 5e-5;         ///< standard deviation of one probe, per axis
  double shift_m = 3e-4;         ///< change that must be detected quickly
  double probes_per_day = 1440;  ///< determines the number of chances for a false alarm per year
  double false_alarms_per_year = 1;
  int reference_probes = 0;  ///< 0: the model is the reference
  /// Standard deviation of the model's mean residual, used if `reference_probes` is 0.
  double reference_sd_m = 0;
  double outlier_share = 0.05;  ///< expected share of outliers
};

/// Average run length (ARL): mean number of probes until one cumulative sum exceeds its threshold
/// although nothing has changed. Markov chain over a grid of sums [D. Brook and D. A. Evans,
/// Biometrika 59 (1972) 539]:
///   ARL = first entry of (I - Q)^-1 1
/// for increments clip(e + n) - allowance with n standard normal, or +-clip with `outlier_share`.
/// Allocates; takes about 1 ms; not for the control cycle.
/// @param offset  e: error of the reference in this direction [sigma]
double MeanRunLength(const MonitorDesign& design, double offset, double outlier_share);

/// Computes the design that meets the requirements: an allowance of half the shift, limited to
/// 0.25..1 sigma, and the smallest threshold (to 0.1 %) for which
///   E over the error of the reference [exp(-probes per year * sum over directions 1/ARL)]
///     >= exp(-false_alarms_per_year).
/// Directions overlap, so some alarms are counted twice and the true rate is lower. A reference
/// estimated from N probes has an error of sigma / sqrt(N) per coordinate, slightly more with
/// outliers. Allocates; takes some tenths of a second.
/// @param step  called between computation steps of about 20 ms each
MonitorDesign MonitorDesignFor(
    const MonitorRequirements& requirements, const std::function<void()>& step = [] {});

}  // namespace plumbline::monitor
