// Fit of relations to the postures of a controller, and how well each predicts postures held out.
#pragma once

#include <vector>

#include "app/measure/controller/relation.h"

namespace plumbline::measure {

using Mat6 = Eigen::Matrix<double, 6, 6>;

/// Relations that hold together: none (nominal), one or two.
using Hypothesis = std::vector<Relation>;

/// Root mean square error of the reported pose.
struct PoseError {
  double distance_m = 0, angle_rad = 0;
};

/// A hypothesis fitted to all postures, and twice to one half to predict the other.
struct HypothesisFit {
  Hypothesis hypothesis;
  Eigen::VectorXd values;      ///< of all parameters
  Eigen::MatrixXd covariance;  ///< of them, the prior included
  double chi_square = 0;       ///< of the residuals of all postures
  /// Logarithm of the probability of all postures, up to a constant: Laplace's approximation with
  /// the priors of the parameters [D. MacKay, Neural Computation 4 (1992) 415].
  double log_evidence = 0;
  double held_out_chi_square = 0;  ///< of the predictions, with the uncertainty of the fit
  double degrees = 0;              ///< numbers predicted
  PoseError held_out;

  /// True if the values of each relation are within what its prior allows (chi-square at 1e-5).
  bool plausible = true;

  /// True if the values are plausible, and the predictions of postures that were held out differ
  /// from what is reported by no more than the resolution explains.
  bool Accepted() const;
};

/// Fits hypotheses to one sample. Not thread-safe.
class RelationFitter {
 public:
  /// @param context  outlives this
  RelationFitter(const RelationContext& context, ControllerSample sample);

  const ControllerSample& sample() const { return sample_; }
  const RelationContext& context() const { return context_; }
  /// Fit without predictions.
  /// @param screening  to a few postures only, which rejects most hypotheses at low cost
  HypothesisFit Fit(const Hypothesis& hypothesis, bool screening = false) const;
  /// The same with the predictions.
  HypothesisFit FitAndPredict(const Hypothesis& hypothesis) const;
  void Predict(HypothesisFit& fit) const;

  /// Pose that the controller would report in another posture.
  Pose ReportedAt(const HypothesisFit& fit, const ControllerPosture& posture) const;
  /// Residuals of the reported poses: position [m] and rotation vector [rad], shape (6, postures).
  Eigen::Matrix<double, 6, Eigen::Dynamic> Residuals(const HypothesisFit& fit) const;
  /// The same in standard deviations of the reported numbers, stacked.
  Eigen::VectorXd WhitenedResiduals(const HypothesisFit& fit) const;
  /// Chi-square of a posture that is not of the sample, with the uncertainty of the fit: one degree
  /// for each number of a pose.
  double Surprise(const HypothesisFit& fit, const ControllerPosture& posture) const;
  /// Squared difference of two fits in a posture, in units of their variances and the noise.
  double Separation(const HypothesisFit& a, const HypothesisFit& b,
                    const ControllerPosture& posture) const;
  ControllerModel ModelOf(const Hypothesis& hypothesis, const Eigen::VectorXd& values) const;

 private:
  using Rows = std::vector<std::size_t>;
  struct Prepared;
  Prepared Prepare(const Hypothesis& hypothesis) const;
  Eigen::VectorXd Whitened(const Prepared& prepared, const Eigen::VectorXd& values,
                           const Rows& rows) const;
  Eigen::MatrixXd JacobianOf(const Prepared& prepared, const Eigen::VectorXd& values,
                             const Rows& rows, const Eigen::VectorXd& at) const;
  void FitRows(const Prepared& prepared, const Rows& rows, const Eigen::VectorXd& start,
               HypothesisFit& fit, bool screening = false) const;
  static bool Plausible(const Prepared& prepared, const Eigen::VectorXd& values);
  Mat6 PredictionVariance(const HypothesisFit& fit, const ControllerPosture& posture) const;
  Eigen::VectorXd StartOf(Prepared& prepared, const Rows& rows) const;

  const RelationContext& context_;
  ControllerSample sample_;
  Rows all_, even_, odd_, screened_;
};

}  // namespace plumbline::measure
