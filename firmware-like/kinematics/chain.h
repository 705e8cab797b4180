// Forward kinematics of a serial arm: link frames, joint axes and Jacobian.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline::kinematics {

/// Jacobian, 6 x n, in B: rows 0-2 linear velocity of a point [m/rad], rows 3-5 angular velocity
/// [rad/rad].
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, model::kMaxJoints>;

/// Changes to the DH table of a chain; each array has one value per joint. T is double or a dual
/// number.
///   dh  T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta) Rz(gamma)   [Hayati & Mirmirani 1985]
///   mdh T_i = Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d)
template <typename T>
struct DhChanges {
  const T* a;      ///< added to a [m]
  const T* d;      ///< added to d [m]
  const T* alpha;  ///< added to alpha [rad]
  const T* beta;   ///< added to beta [rad]
};

/// Joints in an order in which each follows those that it is coupled to. Joints on a cycle, and
/// those that depend on one, are left out.
std::vector<int> CouplingOrder(int joints, const std::vector<model::JointCoupling>& couplings);

/// Link frames and joint axes in one posture, all expressed in B.
template <typename T>
struct PostureOf {
  int size = 0;
  std::array<PoseOf<T>, model::kMaxJoints> X_BL;  ///< DH frame of link i
  std::array<Vec3Of<T>, model::kMaxJoints>
      axis_B;  ///< axis of joint i, in the direction of its positive q_i
  std::array<Vec3Of<T>, model::kMaxJoints> point_B;  ///< a point on that axis [m]

  /// The flange F is the frame of the last link.
  const PoseOf<T>& X_BF() const { return X_BL[size - 1]; }
};

using Posture = PostureOf<double>;

/// A serial arm defined by Denavit-Hartenberg parameters.
///   dh  (distal):   T_i = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i) Ry(beta_i) Rz(gamma_i)
///   mdh (proximal): T_i = Rx(alpha_i) Tx(a_i) Ry(beta_i) Rz(theta_i) Tz(d_i)
/// [Denavit & Hartenberg 1955; Craig, ch. 3; beta: Hayati & Mirmirani 1985]
/// with theta_i = sign_i a_i + offset_i (revolute) or d_i := d_i + sign_i a_i (prismatic), and the
/// axes at a = C q, where q are joint values as the controller reports them (model::JointCoupling);
/// without couplings, a = q. Everything that takes or returns q means the reported values:
/// couplings act here only. Deflections s of the drives (model::DrivePositions) are not modelled
/// here: pass q + D^-1 s for the deflected arm.
class Chain {
 public:
  /// @param robot  with 1..kMaxJoints joints, as checked by the configuration reader
  explicit Chain(const model::Robot& robot);

  int size() const { return size_; }
  model::JointType type(int joint) const { return links_[joint].type; }
  const model::JointVector& lower() const { return lower_; }  ///< limits of q [rad] or [m]
  const model::JointVector& upper() const { return upper_; }
  const std::vector<model::JointCoupling>& couplings() const { return couplings_; }
  /// Joints in an order in which each follows those that it is coupled to.
  const std::vector<int>& coupling_order() const { return coupling_order_; }
  /// a = C q [rad] or [m].
  template <typename T>
  model::JointVectorOf<T> AxisPositions(const model::JointVectorOf<T>& q) const {
    return model::AxisPositions<T>(couplings_, q);
  }
  /// True if a whole turn of the joint's reading leads to the same posture: the joint is revolute,
  /// and each axis that turns with it also makes whole turns.
  bool RepeatsAfterTurn(int joint) const;
  /// D^-1 times positions or deflections of the drives.
  template <typename T>
  model::JointVectorOf<T> ReportedFromDrives(const model::JointVectorOf<T>& drives) const {
    return model::ReportedFromDrives<T>(couplings_, drives);
  }
  /// C^-1 times positions of the axes.
  template <typename T>
  model::JointVectorOf<T> ReportedFromAxes(model::JointVectorOf<T> axes) const {
    for (const model::JointCoupling& coupling : couplings_) {
      axes[coupling.joint] -= coupling.ratio * axes[coupling.of];
    }
    return axes;
  }
  bool WithinLimits(const model::JointVector& q, double margin = 0) const;

  /// Upper bound of the distance between the flange and the origin of B [m].
  double Reach() const { return reach_m_; }

  /// Computes the frames at joint positions q [rad] or [m], shape (n). Does not allocate.
  /// @param changes  null for the table as declared
  template <typename T>
  void Evaluate(const model::JointVectorOf<T>& q, const DhChanges<T>* changes,
                PostureOf<T>& posture) const;
  void Evaluate(const model::JointVector& q, Posture& posture) const {
    Evaluate<double>(q, nullptr, posture);
  }

  /// Jacobian of a point p_BQ [m] that is fixed to the flange, with respect to q.
  void JacobianAt(const Posture& posture, const Vec3& p_BQ, Jacobian& jacobian) const;
  /// The same with respect to the axes.
  void AxisJacobianAt(const Posture& posture, const Vec3& p_BQ, Jacobian& jacobian) const;
  /// The same with respect to the drives, to which deflections are added.
  void DriveJacobianAt(const Posture& posture, const Vec3& p_BQ, Jacobian& jacobian) const;

 private:
  struct Link {
    model::JointType type;
    double a, d, alpha, offset, sign, cos_alpha, sin_alpha;
    double beta, cos_beta, sin_beta, cos_gamma, sin_gamma;
  };

  model::DhConvention convention_;
  int size_;
  std::array<Link, model::kMaxJoints> links_;
  model::JointVector lower_, upper_;
  std::vector<int> coupling_order_;
  std::vector<model::JointCoupling> couplings_;  ///< in the order of their joints
  double reach_m_ = 0;
};

template <typename T>
void Chain::Evaluate(const model::JointVectorOf<T>& q, const DhChanges<T>* changes,
                     PostureOf<T>& posture) const {
  using std::cos, std::sin;
  posture.size = size_;
  const model::JointVectorOf<T> axes = AxisPositions<T>(q);
  PoseOf<T> X_BL;
  for (std::size_t i = 0; i < static_cast<std::size_t>(size_); ++i) {
    const Link& link = links_[i];
    const T count = link.sign * axes[static_cast<int>(i)];
    const bool turns = link.type == model::JointType::kRevolute;
    const T theta = turns ? T(link.offset + count) : T(link.offset);
    T a(link.a), d = turns ? T(link.d) : T(link.d + count);
    T ca(link.cos_alpha), sa(link.sin_alpha), cb(link.cos_beta), sb(link.sin_beta);
    if (changes != nullptr) {
      a += changes->a[i];
      d += changes->d[i];
      const T alpha = link.alpha + changes->alpha[i];
      ca = cos(alpha);
      sa = sin(alpha);
      const T beta = link.beta + changes->beta[i];
      cb = cos(beta);
      sb = sin(beta);
    }
    const T c = cos(theta), s = sin(theta), zero(0);
    PoseOf<T> X;  // pose of this link frame in the previous one
    if (convention_ == model::DhConvention::kDistal) {
      posture.axis_B[i] = link.sign * X_BL.R.col(2);
      posture.point_B[i] = X_BL.p;
      X.R << c, -s * ca, s * sa, s, c * ca, -c * sa, zero, sa, ca;
      X.p << a * c, a * s, d;
      if (changes != nullptr || link.sin_beta != 0) {
        const Vec3Of<T> x = X.R.col(0), z = X.R.col(2);
        X.R.col(0) = cb * x - sb * z;
        X.R.col(2) = sb * x + cb * z;
      }
      if (link.sin_gamma != 0 || link.cos_gamma != 1) {
        const Vec3Of<T> x = X.R.col(0), y = X.R.col(1);
        X.R.col(0) = link.cos_gamma * x + link.sin_gamma * y;
        X.R.col(1) = link.cos_gamma * y - link.sin_gamma * x;
      }
    } else {
      X.R << c * cb, -s * cb, sb,                                //
          s * ca + c * sa * sb, c * ca - s * sa * sb, -sa * cb,  //
          s * sa - c * ca * sb, c * sa + s * ca * sb, ca * cb;
      X.p << a + sb * d, -sa * cb * d, ca * cb * d;
    }
    X_BL = X_BL * X;
    posture.X_BL[i] = X_BL;
    if (convention_ == model::DhConvention::kProximal) {
      posture.axis_B[i] = link.sign * X_BL.R.col(2);
      posture.point_B[i] = X_BL.p;
    }
  }
}

}  // namespace plumbline::kinematics
