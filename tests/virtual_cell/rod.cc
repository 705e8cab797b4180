#include "tests/virtual_cell/rod.h"

#include <algorithm>
#include <cmath>

namespace virtual_cell {
namespace {

/// State of the rod at one arc length.
struct Section {
  Vec3 r = Vec3::Zero();
  Eigen::Vector4d q = Eigen::Vector4d(0, 0, 0, 1);  ///< quaternion x, y, z, w, nearly unit
  Vec3 m = Vec3::Zero();

  Section Plus(const Section& rate, double h) const {
    return {r + h * rate.r, q + h * rate.q, m + h * rate.m};
  }
};

Section Rate(const Section& at, const Vec3& n, const RodSegment& rod, const RodOptions& options) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(at.q).normalized();
  const Mat3 R = q.toRotationMatrix();
  const Vec3 m_body = R.transpose() * at.m;
  const Vec3 kappa(m_body.x() / (rod.EI_x * options.bending_factor),
                   m_body.y() / (rod.EI_y * options.bending_factor), m_body.z() / rod.GJ);
  Vec3 stretch = Vec3::UnitZ();
  if (options.shear_factor > 0) {
    const Vec3 n_body = R.transpose() * n;
    const double kGA = options.shear_factor * rod.GA;
    stretch += Vec3(n_body.x() / kGA, n_body.y() / kGA, n_body.z() / rod.EA);
  }
  Section rate;
  rate.r = R * stretch;
  rate.q = 0.5 * (q * Eigen::Quaterniond(0, kappa.x(), kappa.y(), kappa.z())).coeffs();
  rate.m = -rate.r.cross(n);
  return rate;
}

double Length(const std::vector<RodSegment>& segments) {
  double length = 0;
  for (const RodSegment& segment : segments) length += segment.length_m;
  return length;
}

Vec3 Weight(const std::vector<RodSegment>& segments, const Vec3& gravity) {
  Vec3 weight = Vec3::Zero();
  for (const RodSegment& segment : segments) {
    weight += segment.weight_kg_m * segment.length_m * gravity;
  }
  return weight;
}

/// Integrates the rod from a root moment to the tip.
Section Integrate(const std::vector<RodSegment>& segments, const RodLoad& load,
                  const RodOptions& options, const Vec3& root_moment) {
  Section at;
  at.m = root_moment;
  Vec3 n = load.tip_force + Weight(segments, load.gravity);
  const double length = Length(segments);
  for (const RodSegment& rod : segments) {
    const int steps =
        std::max(4, static_cast<int>(std::ceil(options.steps * rod.length_m / length)));
    const double h = rod.length_m / steps;
    const Vec3 half = rod.weight_kg_m * load.gravity * (h / 2);
    for (int i = 0; i < steps; ++i) {
      const Section k1 = Rate(at, n, rod, options);
      const Section k2 = Rate(at.Plus(k1, h / 2), n - half, rod, options);
      const Section k3 = Rate(at.Plus(k2, h / 2), n - half, rod, options);
      const Section k4 = Rate(at.Plus(k3, h), n - 2 * half, rod, options);
      at = at.Plus(k1, h / 6).Plus(k2, h / 3).Plus(k3, h / 3).Plus(k4, h / 6);
      at.q.normalize();
      n -= 2 * half;
    }
  }
  return at;
}

Mat3 RotationOf(const Section& section) {
  return Eigen::Quaterniond(section.q).toRotationMatrix();
}

/// Newton iteration on the root moment for one load. @return true if it converged
bool Shoot(const std::vector<RodSegment>& segments, const RodLoad& load, const RodOptions& options,
           Vec3& root_moment, Section& tip) {
  const auto mismatch = [&](const Vec3& moment, Section& end) -> Vec3 {
    end = Integrate(segments, load, options, moment);
    return end.m - (RotationOf(end) * load.tip_offset).cross(load.tip_force);
  };
  const double scale =
      1e-6 + (load.tip_force.norm() + Weight(segments, load.gravity).norm()) * Length(segments);
  Vec3 miss = mismatch(root_moment, tip);
  for (int iteration = 0; iteration < 30 && miss.allFinite(); ++iteration) {
    if (miss.norm() < 1e-12 * scale) return true;
    Mat3 slope;
    const double step = 1e-6 * scale;
    for (int k = 0; k < 3; ++k) {
      Section unused;
      slope.col(k) = (mismatch(root_moment + step * Vec3::Unit(k), unused) - miss) / step;
    }
    const Vec3 change = slope.fullPivLu().solve(miss);
    const double before = miss.norm();
    double damping = 1;
    do {
      miss = mismatch(root_moment - damping * change, tip);
      if (miss.norm() < before) break;
      damping /= 2;
    } while (damping > 1e-3);
    root_moment -= damping * change;
    if (miss.norm() >= before) return before < 1e-9 * scale;
  }
  return false;
}

}  // namespace

RodShape SolveRod(const std::vector<RodSegment>& segments, const RodLoad& load,
                  const RodOptions& options, const Vec3& guess) {
  RodShape shape;
  shape.root_force = load.tip_force + Weight(segments, load.gravity);
  for (int load_steps = 1; load_steps <= 64 && !shape.converged; load_steps *= 4) {
    Vec3 moment = load_steps == 1 ? guess : Vec3::Zero();
    Section tip;
    shape.converged = true;
    for (int step = 1; step <= load_steps && shape.converged; ++step) {
      const double share = static_cast<double>(step) / load_steps;
      const RodLoad part{load.gravity * share, load.tip_force * share, load.tip_offset};
      shape.converged = Shoot(segments, part, options, moment, tip);
    }
    shape.root_moment = moment;
    shape.tip.linear() = RotationOf(tip);
    shape.tip.translation() = tip.r;
  }
  return shape;
}

}  // namespace virtual_cell
