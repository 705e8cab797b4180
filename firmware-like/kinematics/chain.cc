#include "firmware-like/kinematics/chain.h"

#include <algorithm>
#include <cmath>

namespace plumbline::kinematics {

std::vector<int> CouplingOrder(int joints, const std::vector<model::JointCoupling>& couplings) {
  std::vector<int> order;
  const auto placed = [&](int joint) {
    return std::find(order.begin(), order.end(), joint) != order.end();
  };
  for (bool growing = true; growing;) {
    const std::size_t before = order.size();
    for (int joint = 0; joint < joints; ++joint) {
      const bool ready = std::all_of(couplings.begin(), couplings.end(), [&](const auto& coupling) {
        return coupling.joint != joint || placed(coupling.of);
      });
      if (ready && !placed(joint)) order.push_back(joint);
    }
    growing = order.size() > before;
  }
  return order;
}

Chain::Chain(const model::Robot& robot)
    : convention_(robot.convention),
      size_(robot.size()),
      lower_(size_),
      upper_(size_),
      coupling_order_(CouplingOrder(size_, robot.couplings)) {
  assert(size_ >= 1 && size_ <= model::kMaxJoints);
  assert(static_cast<int>(coupling_order_.size()) == size_);
  for (const int joint : coupling_order_) {
    for (const model::JointCoupling& coupling : robot.couplings) {
      if (coupling.joint == joint) couplings_.push_back(coupling);
    }
  }
  for (int i = 0; i < size_; ++i) {
    const model::Joint& joint = robot.joints[i];
    links_[i] = {joint.type,
                 joint.a_m,
                 joint.d_m,
                 joint.alpha_rad,
                 joint.theta_offset_rad,
                 static_cast<double>(joint.sign),
                 std::cos(joint.alpha_rad),
                 std::sin(joint.alpha_rad),
                 joint.beta_rad,
                 std::cos(joint.beta_rad),
                 std::sin(joint.beta_rad),
                 std::cos(joint.gamma_rad),
                 std::sin(joint.gamma_rad)};
    lower_[i] = joint.min;
    upper_[i] = joint.max;
    reach_m_ += std::hypot(joint.a_m, joint.d_m);
    if (joint.type == model::JointType::kPrismatic) {
      reach_m_ += std::max(std::abs(joint.min), std::abs(joint.max));
    }
  }
}

bool Chain::WithinLimits(const model::JointVector& q, double margin) const {
  return ((q.array() >= lower_.array() - margin) && (q.array() <= upper_.array() + margin)).all();
}

void Chain::JacobianAt(const Posture& posture, const Vec3& p_BQ, Jacobian& jacobian) const {
  AxisJacobianAt(posture, p_BQ, jacobian);
  for (const model::JointCoupling& coupling : couplings_) {
    jacobian.col(coupling.of) += coupling.ratio * jacobian.col(coupling.joint);
  }
}

void Chain::DriveJacobianAt(const Posture& posture, const Vec3& p_BQ, Jacobian& jacobian) const {
  AxisJacobianAt(posture, p_BQ, jacobian);
  for (const model::JointCoupling& coupling : couplings_) {
    if (coupling.drive != model::CouplingDrive::kReading) continue;
    jacobian.col(coupling.of) += coupling.ratio * jacobian.col(coupling.joint);
  }
}

bool Chain::RepeatsAfterTurn(int joint) const {
  constexpr double kWhole = 1e-9;
  const auto repeats = [&](const model::JointCoupling& coupling) {
    return coupling.of != joint || (links_[coupling.joint].type == model::JointType::kRevolute &&
                                    std::abs(coupling.ratio - std::round(coupling.ratio)) < kWhole);
  };
  return links_[joint].type == model::JointType::kRevolute &&
         std::all_of(couplings_.begin(), couplings_.end(), repeats);
}

void Chain::AxisJacobianAt(const Posture& posture, const Vec3& p_BQ, Jacobian& jacobian) const {
  jacobian.resize(6, size_);
  for (int i = 0; i < size_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Vec3& axis = posture.axis_B[k];
    if (links_[k].type == model::JointType::kRevolute) {
      jacobian.col(i).head<3>() = axis.cross(p_BQ - posture.point_B[k]);
      jacobian.col(i).tail<3>() = axis;
    } else {
      jacobian.col(i).head<3>() = axis;
      jacobian.col(i).tail<3>().setZero();
    }
  }
}

}  // namespace plumbline::kinematics
