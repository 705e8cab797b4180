// Watches the residuals of probes for a change that noise does not explain.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "firmware-like/geometry/pose.h"

namespace plumbline {

/// Most probes that a reference may be estimated from; fixes the storage.
inline constexpr int kMaxReferenceProbes = 100;

/// How the monitor decides; MonitorDesignFor() of run_length.h computes it.
struct MonitorDesign {
  double sigma_m = 5e-5;     ///< scatter of one probe, one axis
  int reference_probes = 0;  ///< 0: the reference is the model (a residual of zero)
  double allowance = 1;      ///< k: change per probe that is let pass [sigma]
  double threshold = 10;     ///< h [sigma]
  double clip = 3;           ///< a probe counts at most this much [sigma]
};

/// A change that noise does not explain.
struct DriftAlarm {
  std::uint64_t probe = 0;      ///< number of the probe that raised it, the first one being 1
  std::uint64_t first_probe = 0;      ///< the first probe that took part
  Vec3 shift_m = Vec3::Zero();  ///< estimated change, clipped probes included, frame of the probes
};

/// Why the probes of a reference are not one place with scatter.
enum class ReferenceFault : std::uint8_t {
  kNone,
  kOutliers,  ///< more of them are wild than outlier_share explains
  kScatter,   ///< they scatter by more than kMostScatter times what was declared
  kTrend,     ///< they scatter by more than was declared, and each resembles the one before it
};

/// What one probe was to the monitor.
struct ProbeVerdict {
  bool learning = false;   ///< it went into the reference; nothing was judged
  bool unmonitored = false;  ///< the reference was refused; nothing was judged
  bool outlier = false;       ///< farther than clip sqrt(3) sigma from the reference
  double statistic = 0;    ///< the largest sum divided by the threshold
  bool raised = false;     ///< this probe raised the alarm
};

/// Two-sided cumulative sums of the whitened residual along 13 axes: the three coordinate axes,
/// the six diagonals of the faces and the four of the cube, so that every direction has one within
/// 28 degrees. With z = (r - reference) / sigma, for each of the 26 signed directions u:
///   S := max(0, S + min(max(u.z, -clip), clip) - allowance);   alarm where S > threshold
/// [E. S. Page, Biometrika 41 (1954) 100; clipped increments: winsorised]. One wild probe adds at
/// most clip - allowance, which is far below any threshold that MonitorDesignFor() gives.
///
/// The reference stands once it is there: a slow drift cannot be followed away. It is the mean of
/// the first probes, each clipped about their median (one step of Huber's M-estimate). It is
/// refused where its N members r_i disagree, with m their median, s the scatter in use (below) and
/// sigma the declared one:
///   outliers  more members with |r_i - m|^2 / s^2 > 21.1, the 99.99 % quantile of chi^2 of 3
///             degrees, than there are in 99 % of references where each probe is wild with
///             probability kOutlierShare: 2 of 5, 3 of 10, 4 of 20 are let pass;
///   scatter   s > kMostScatter sigma: two populations of similar size, or a wrong sigma;
///   trend     s > 2 sigma and von Neumann's ratio of the clipped members,
///             eta = sum |r_i+1 - r_i|^2 / sum |r_i - mean|^2, below its 0.01 % quantile
///             2 - 3.72 sqrt(4 (N - 2) / (3 (N^2 - 1)))   [J. von Neumann, Ann. Math. Stat. 12
///             (1941) 367]: a step or a drift while the reference was taken.
/// Then nothing is judged until Restart().
///
/// The scatter in use is the larger one of what was declared and what the first probes show, for
/// false alarms grow by the hundred where it is too small:
///   sigma^2 = median |r - median r|^2 / 2.366,   2.366 being the median of chi^2 of 3 degrees,
/// over the reference's probes (5 at least); where the model is the reference, of the differences
/// of the first 20 probes that follow each other, halved: offset and drift leave these alone. Of 20
/// probes sigma has a deviation of 12 %; its upper end by half of that is used.
///
/// Allocates nothing; no clock.
class DriftMonitor {
 public:
  explicit DriftMonitor(const MonitorDesign& design);

  /// @param residual_m  measured minus predicted [m], finite
  ProbeVerdict Update(const Vec3& residual_m);

  /// Forgets everything, the reference too.
  void Restart();

  const MonitorDesign& design() const { return design_; }
  std::uint64_t probes() const { return probes_; }
  bool learning() const { return !reference_known_ && !reference_refused(); }
  bool reference_refused() const { return fault_ != ReferenceFault::kNone; }
  ReferenceFault reference_fault() const { return fault_; }
  /// Whether the k-th probe of a refused reference, counted from 0, is one of those that disagree.
  bool Disagrees(int k) const;
  Vec3 reference_m() const { return reference_m_; }
  double sigma_m() const { return sigma_m_; }  ///< in use: declared, or shown by the first probes
  double statistic() const { return statistic_; }
  /// Stands from the probe that raised it until Restart().
  const std::optional<DriftAlarm>& alarm() const { return alarm_; }

  static constexpr double kMostScatter = 10;
  static constexpr double kOutlierShare = 0.05;

  static constexpr int kAxes = 13;
  /// Unit vectors of the axes; each is watched in both senses.
  static const std::array<Vec3, kAxes>& Axes();

 private:
  struct Chart {
    double sum = 0;
    std::uint64_t first_probe = 0;    ///< first probe since the sum was last zero
    Vec3 total = Vec3::Zero();  ///< of the clipped whitened residuals since then
  };

  void Learn(const Vec3& residual_m);
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
  double sigma_m_ = 0;
  std::uint64_t probes_ = 0;
  double statistic_ = 0;
  std::array<Chart, std::size_t{2} * kAxes> charts_;
  std::optional<DriftAlarm> alarm_;
};

}  // namespace plumbline
