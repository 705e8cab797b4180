// Drift monitor: detects changes in probe residuals that noise does not explain.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "firmware-like/geometry/pose.h"

namespace plumbline::monitor {

/// Largest number of reference probes; determines the storage.
inline constexpr int kMaxReferenceProbes = 100;

/// Parameters of the monitor, computed by MonitorDesignFor() in run_length.h.
struct MonitorDesign {
  double sigma_m = 5e-5;     ///< standard deviation of one probe, per axis
  int reference_probes = 0;  ///< 0: the model is the reference (a residual of zero)
  double allowance = 1;      ///< k: tolerated change per probe [sigma]
  double threshold = 10;     ///< h [sigma]
  double clip = 3;           ///< limit of a probe's contribution [sigma]
};

/// A change that noise does not explain.
struct DriftAlarm {
  std::uint64_t probe = 0;        ///< number of the probe that raised it, from 1
  std::uint64_t first_probe = 0;  ///< first probe that contributed
  Vec3 shift_m = Vec3::Zero();    ///< estimated change in the frame of the probes; outliers clipped
};

/// Reason for refusing a reference.
enum class ReferenceFault : std::uint8_t {
  kNone,
  kOutliers,  ///< more outliers than kOutlierShare explains
  kScatter,   ///< the scatter exceeds kMaxScatterRatio times the declared one
  kTrend,     ///< the scatter exceeds the declared one, and consecutive probes are correlated
};

/// The monitor's verdict on one probe.
struct ProbeVerdict {
  bool learning = false;     ///< used for the reference; not evaluated
  bool unmonitored = false;  ///< the reference was refused; not evaluated
  bool outlier = false;      ///< further than clip sqrt(3) sigma from the reference
  double statistic = 0;      ///< the largest sum divided by the threshold
  bool raised = false;       ///< this probe raised the alarm
};

/// Two-sided cumulative sums (CUSUM) of the whitened residual along 13 axes: the three coordinate
/// axes, the six face diagonals and the four space diagonals of the cube. Every direction is within
/// 28 degrees of one of these axes. With z = (r - reference) / sigma, for each of the 26 signed
/// directions u:
///   S := max(0, S + min(max(u.z, -clip), clip) - allowance);   alarm if S > threshold
/// [E. S. Page, Biometrika 41 (1954) 100; clipped increments: winsorised]. A single outlier adds at
/// most clip - allowance, far below any threshold that MonitorDesignFor() returns.
///
/// The reference is fixed once it is complete, so it cannot follow a slow drift. It is the mean of
/// the first probes, each clipped about their median (one step of Huber's M-estimator). It is
/// refused if its N members r_i disagree. With m their median, s the scatter in use (below) and
/// sigma the declared one:
///   outliers  more members with |r_i - m|^2 / s^2 > 21.1, the 99.99 % quantile of chi^2 with 3
///             degrees of freedom, than occur in 99 % of references in which each probe is an
///             outlier with probability kOutlierShare; 2 of 5, 3 of 10 and 4 of 20 are accepted;
///   scatter   s > kMaxScatterRatio sigma: two populations of similar size, or a wrong sigma;
///   trend     a step or a drift while the reference was taken: s > 2 sigma, and von Neumann's
///             ratio of the clipped members,
///             eta = sum |r_i+1 - r_i|^2 / sum |r_i - mean|^2, below its 0.01 % quantile
///             2 - 3.72 sqrt(4 (N - 2) / (3 (N^2 - 1)))   [J. von Neumann, Ann. Math. Stat. 12
///             (1941) 367].
/// After a refusal nothing is monitored until Restart().
///
/// The scatter in use is the larger of the declared one and that of the first probes, because a
/// sigma that is too small multiplies false alarms:
///   sigma^2 = median |r - median r|^2 / 2.366,   2.366 = median of chi^2 (3 degrees of freedom),
/// over the reference probes (at least 5). If the model is the reference, the halved squared
/// differences of consecutive probes among the first 20 are used instead, because offset and drift
/// do not affect them. Estimated from 20 probes, sigma has a standard deviation of 12 %; half of
/// that is added as a margin.
///
/// Does not allocate and reads no clock.
class DriftMonitor {
 public:
  explicit DriftMonitor(const MonitorDesign& design);

  /// Processes the next probe.
  /// @param residual_m  measured minus predicted [m]; must be finite (asserted)
  /// @param radius_m    95 % radius that was stated for the prediction [m]; 0: none
  ProbeVerdict Update(const Vec3& residual_m, double radius_m = 0);

  /// Discards everything, including the reference.
  void Restart();

  const MonitorDesign& design() const { return design_; }
  std::uint64_t probes() const { return probes_; }
  bool learning() const { return !reference_known_ && !reference_refused(); }
  bool reference_refused() const { return fault_ != ReferenceFault::kNone; }
  ReferenceFault reference_fault() const { return fault_; }
  /// True if probe k (0-based) of a refused reference disagrees with the others.
  bool Disagrees(int k) const;
  Vec3 reference_m() const { return reference_m_; }
  /// Mean of the radii that were stated for the reference's probes [m]; 0 if one of them has none,
  /// or if the model is the reference.
  double reference_radius_m() const { return reference_known_ ? mean_radius_m_ : 0; }
  double sigma_m() const { return sigma_m_; }  ///< scatter in use
  double statistic() const { return statistic_; }
  /// Set from the probe that raised the alarm until Restart().
  const std::optional<DriftAlarm>& alarm() const { return alarm_; }

  static constexpr double kMaxScatterRatio = 10;
  static constexpr double kOutlierShare = 0.05;

  static constexpr int kAxes = 13;
  /// Unit vectors of the axes; each is monitored in both directions.
  static const std::array<Vec3, kAxes>& Axes();

 private:
  struct Chart {
    double sum = 0;
    std::uint64_t first_probe = 0;  ///< first probe since the sum was last zero
    Vec3 total = Vec3::Zero();      ///< of the clipped whitened residuals since then
  };

  void Learn(const Vec3& residual_m, double radius_m);
  ReferenceFault FaultOfReference() const;
  void LearnScatter(const Vec3& residual_m);
  void UseScatter(double median_square_m2, int count);
  bool Advance(Chart& chart, const Vec3& direction, const Vec3& z);

  MonitorDesign design_;
  std::array<Vec3, kMaxReferenceProbes> learned_;
  bool reference_known_ = false;
  ReferenceFault fault_ = ReferenceFault::kNone;
  Vec3 median_m_ = Vec3::Zero();  ///< of the reference's probes
  Vec3 reference_m_ = Vec3::Zero();
  double mean_radius_m_ = 0;  ///< of the reference's probes; 0 from the first without a radius
  double sigma_m_ = 0;
  std::uint64_t probes_ = 0;
  double statistic_ = 0;
  std::array<Chart, std::size_t{2} * kAxes> charts_;
  std::optional<DriftAlarm> alarm_;
};

}  // namespace plumbline::monitor
