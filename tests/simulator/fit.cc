#include "tests/simulator/fit.h"

#include <fmt/core.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace simulator {
namespace {

/// Parameter step that moves the tip by some micrometres.
double StepOf(const Parameter& parameter) {
  const std::string& unit = parameter.unit;
  if (unit == "mm") return 1e-3;
  if (unit == "deg") return 1e-5;
  if (unit == "rad") return 1e-6;
  if (unit == "rad/(N m)" || unit == "m/N") return 1e-10;
  if (unit == "1/(N m^2)") return 1e-11;
  if (unit == "rad/(N m)^3") return 1e-17;
  if (unit == "N m") return 0.1;
  if (unit == "kg") return 1e-3;
  if (unit == "1/K") return 1e-8;
  if (unit == "s^2") return 1e-6;
  if (unit == "1/turn") return 1e-4;
  if (unit == "mm/bar") return 1e-2;
  if (unit == "s") return parameter.name == "time" ? 1e-6 : 0.1;
  if (unit == "1") return 1e-6;
  return std::max(1e-9, 1e-5 * std::abs(parameter.value));
}

Effect One(const std::string& id, const std::string& name, double value, const std::string& unit,
           std::vector<std::string> scope = {}, const std::string& by = {}) {
  return {.id = id,
          .scope = std::move(scope),
          .parameters = {{name, value, unit}},
          .by = by,
          .frame = {},
          .session = {}};
}

struct Candidate {
  Effect effect;  ///< with the step as value
  double step;
  std::string name;
};

std::vector<Candidate> Candidates(const Cell& cell, const Table& table,
                                  const std::vector<double>& cycles) {
  std::vector<Candidate> list;
  const auto add = [&](Effect effect, const std::string& label = {}) {
    Parameter& p = effect.parameters[0];
    p.value = StepOf(p);
    list.push_back({effect, p.value, label.empty() ? p.name : label});
  };
  const auto vector = [&](const std::string& id) {
    for (const char* axis : {"x", "y", "z"}) add(One(id, axis, 0.0, "mm"));
  };
  vector("base_frame");
  for (const char* angle : {"roll", "pitch", "yaw"}) add(One("base_frame", angle, 0.0, "deg"));
  vector("tool_frame");
  for (int i = 1; i <= int(cell.joints.size()); ++i) {
    const std::string q = fmt::format("q{}", i);
    const auto joint = [&](const std::string& id, const std::string& unit,
                           const std::string& by = {}) {
      add(One(id, q, 0.0, unit, {q}, by), by.empty() ? q : fmt::format("{}_{}", q, by));
    };
    joint("joint_offset", "rad");
    joint("gear_ratio", "1");
    for (const char* name : {"a", "d", "alpha", "beta"}) {
      add(One("link_geometry", fmt::format("{}{}", name, i), 0.0,
              std::string(name).size() > 1 ? "deg" : "mm", {q}));
    }
    joint("joint_compliance", "rad/(N m)");
    joint("compliance_asymmetry", "rad/(N m)");
    joint("joint_hardening", "rad/(N m)^3");
    joint("backlash", "rad", "load");
    joint("backlash", "rad", "move");
    joint("approach_lag", "1");
    joint("following_error", "rad");
    joint("arrival_friction", "rad/(N m)");
    for (int of = 1; of < i; ++of) {
      add(One("axis_coupling", fmt::format("{}_of_q{}", q, of), 0.0, "1", {q}));
    }
    if (cell.joints[std::size_t(i - 1)].prismatic) {
      joint("axis_bending", "1/(N m^2)");
      for (const char* axis : {"_x", "_y"}) add(One("guide_play", q + axis, 0.0, "rad", {q}));
    } else if (i > 1) {
      joint("bearing_tilt", "rad/(N m)");
    }
    add(One("link_bending", q, 0.0, "rad/(N m)", {q}));
    add(One("link_bending", q + "_torsion", 0.0, "rad/(N m)", {q}));
    const bool weighed = std::all_of(cell.joints.begin(), cell.joints.end(),
                                     [](const Joint& j) { return j.mass_known; });
    for (int link = i; link <= int(cell.joints.size()) && !weighed; ++link) {
      for (const char* across : {"x", "y"}) {
        add(One("gravity_sag", fmt::format("{}_link{}_{}", q, link, across), 0.0, "rad", {q}));
      }
    }
    if (!weighed) add(One("gravity_sag", q, 0.0, "rad/(N m)", {q}));
    if (table.qdd) joint("dynamic_inertia", "s^2");
    for (const double n : cycles) {
      for (const double phase : {0.0, M_PI / 2.0}) {
        Effect wave = One("gear_periodic", q + "_amplitude", 0.0, "rad", {q});
        wave.parameters.push_back({q + "_cycles", n, "1/turn"});
        wave.parameters.push_back({q + "_phase", phase, "rad"});
        add(wave, fmt::format("{}_{}_{:g}", q, phase == 0.0 ? "sin" : "cos", n));
      }
    }
  }
  for (const double phase : {0.0, M_PI / 2.0}) {
    Effect balance = One("counterbalance", "q2_amplitude", 0.0, "N m", {"q2"});
    balance.parameters.push_back({"q2_phase", phase, "rad"});
    add(balance, phase == 0.0 ? "q2_sin" : "q2_cos");
  }
  if (!cell.tool.rigid) {
    add(One("tool_stiffness", "ratio", 0.0, "1"));
    Effect shear = One("tool_shear", "kappa", 1e3, "1");
    list.push_back({shear, 1e-3, "inverse_kappa"});
    add(One("tool_root_compliance", "compliance", 0.0, "rad/(N m)"));
  }
  if (cell.payload_cog_m && table.payload) {
    add(One("payload_mass", "scale", 0.0, "1"));
    vector("payload_cog");
  }
  if (cell.payload_cog_m) add(One("payload_mass", "constant", 0.0, "kg"));
  add(One("gravity_direction", "x", 0.0, "rad"));
  add(One("gravity_direction", "y", 0.0, "rad"));
  add(One("pedestal_compliance", "compliance", 0.0, "rad/(N m)"));
  if (table.temp) add(One("thermal_growth", "alpha", 0.0, "1/K"));
  if (table.qd) add(One("latency", "time", 0.0, "s"));
  add(One("measurement_scale", "scale", 0.0, "1"));
  if (cell.anchor_m) {
    add(One("range_zero", "zero", 0.0, "mm"));
    vector("range_anchor");
  }
  if (table.tilt) add(One("base_tilt", "gain", 0.0, "1"));
  for (const char* axis : {"x", "y"}) {
    Effect tilted = One("tilt_event", axis, 0.0, "deg");  // active from the first row
    tilted.parameters.push_back({"time", -1e9, "s", true});
    add(tilted);
  }
  if (cell.camera) {
    add(One("camera_tag_size", "scale", 0.0, "1"));
    add(One("camera_zoom", "scale", 0.0, "1"));
    add(One("camera_lens", "k1", 0.0, "1"));
  }
  return list;
}

struct Slot {
  std::size_t effect, parameter;
  double step;
};

std::vector<Slot> Free(const Effects& form) {
  std::vector<Slot> slots;
  for (std::size_t e = 0; e < form.size(); ++e) {
    for (std::size_t p = 0; p < form[e].parameters.size(); ++p) {
      const Parameter& parameter = form[e].parameters[p];
      if (!parameter.fixed) slots.push_back({e, p, StepOf(parameter)});
    }
  }
  return slots;
}

/// Huber weights of the rows from the norm of their 3-D error, k = 2.5 robust standard deviations;
/// zero if a coordinate was not measured.
Eigen::VectorXd Weights(const Eigen::VectorXd& residual, const Eigen::VectorXd& measured,
                        Eigen::Index axes) {
  const Eigen::Index rows = residual.size() / axes;
  Eigen::VectorXd norm(rows);
  std::vector<double> sorted;
  for (Eigen::Index k = 0; k < rows; ++k) {
    norm[k] = residual.segment(axes * k, axes).norm();
    if (measured.segment(axes * k, axes).minCoeff() > 0.0) sorted.push_back(norm[k]);
  }
  const std::size_t middle = sorted.size() / 2;
  std::nth_element(sorted.begin(), sorted.begin() + std::ptrdiff_t(middle), sorted.end());
  // The median of the norm is 1.538 sigma for three axes, 0.6745 sigma for one.
  const double limit =
      2.5 * sorted.at(middle) / (axes == 1 ? 0.6745 : 1.538) * std::sqrt(double(axes));
  Eigen::VectorXd weight(residual.size());
  for (Eigen::Index k = 0; k < rows; ++k) {
    weight.segment(axes * k, axes).setConstant(norm[k] <= limit ? 1.0 : std::sqrt(limit / norm[k]));
  }
  return weight.cwiseProduct(measured);
}

}  // namespace

std::vector<Column> Columns(const Cell& cell, const Effects& effects, const Table& table,
                            const std::vector<double>& cycles) {
  const Eigen::VectorXd here = Readings(cell, effects, table.rows);
  std::vector<Column> columns;
  for (const Candidate& candidate : Candidates(cell, table, cycles)) {
    Effects moved = effects;
    moved.push_back(candidate.effect);
    columns.push_back({candidate.effect.id, candidate.name, candidate.effect.parameters[0].unit,
                       candidate.effect.scope,
                       (Readings(cell, moved, table.rows) - here) / candidate.step});
  }
  return columns;
}

FitResult Fit(const Cell& cell, const Effects& form, const Table& measured) {
  const Eigen::Index axes = cell.anchor_m ? 1 : 3;
  Eigen::VectorXd points(axes * Eigen::Index(measured.rows.size()));
  for (Eigen::Index k = 0; k < Eigen::Index(measured.rows.size()); ++k) {
    const Row& row = measured.rows[std::size_t(k)];
    if (cell.anchor_m) {
      points[k] = row.range_m * 1e3;
    } else {
      points.segment<3>(3 * k) = row.xyz_m * 1e3;
    }
  }
  const Eigen::VectorXd is_measured = points.array().isFinite().cast<double>();
  points = is_measured.array().select(points, 0.0).eval();
  const auto residual_of = [&](const Effects& effects) -> Eigen::VectorXd {
    return is_measured.cwiseProduct(points - Readings(cell, effects, measured.rows));
  };
  const std::vector<Slot> slots = Free(form);
  FitResult best{form, 0.0};
  Eigen::VectorXd residual = residual_of(best.effects);
  double damping = 1e-6;
  for (int iteration = 0; iteration < 60 && !slots.empty(); ++iteration) {
    const Eigen::VectorXd weight = Weights(residual, is_measured, axes);
    Eigen::MatrixXd slope(points.size(), Eigen::Index(slots.size()));
    for (std::size_t j = 0; j < slots.size(); ++j) {
      Effects moved = best.effects;
      moved[slots[j].effect].parameters[slots[j].parameter].value += slots[j].step;
      slope.col(Eigen::Index(j)) =
          weight.cwiseProduct(Readings(cell, moved, measured.rows) - (points - residual)) /
          slots[j].step;
    }
    Eigen::VectorXd norm = slope.colwise().norm().transpose();
    for (double& value : norm) value = std::max(value, 1e-300);
    slope.array().rowwise() /= norm.transpose().array();
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(slope, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Eigen::VectorXd& s = svd.singularValues();
    const Eigen::VectorXd along = svd.matrixU().transpose() * weight.cwiseProduct(residual);
    const double cost = weight.cwiseProduct(residual).squaredNorm();
    bool improved = false;
    double gain = 0.0;
    for (int attempt = 0; attempt < 12 && !improved; ++attempt) {
      Eigen::VectorXd scaled(s.size());
      for (int i = 0; i < s.size(); ++i) {
        scaled[i] = s[i] < 1e-7 * s[0] ? 0.0 : along[i] * s[i] / (s[i] * s[i] + damping);
      }
      const Eigen::VectorXd step = (svd.matrixV() * scaled).cwiseQuotient(norm);
      Effects moved = best.effects;
      for (std::size_t j = 0; j < slots.size(); ++j) {
        moved[slots[j].effect].parameters[slots[j].parameter].value += step[Eigen::Index(j)];
      }
      const Eigen::VectorXd after = residual_of(moved);
      const double next = weight.cwiseProduct(after).squaredNorm();
      if (next < cost) {
        improved = true;
        gain = (cost - next) / cost;
        best.effects = moved;
        residual = after;
        damping = std::max(damping * 0.1, 1e-14);
      } else {
        damping = std::min(damping * 10.0, 1e3);
      }
    }
    if (!improved || gain < 1e-10) break;
  }
  best.rms_m = std::sqrt(double(axes) * residual.squaredNorm() / is_measured.sum()) * 1e-3;
  return best;
}

}  // namespace simulator
