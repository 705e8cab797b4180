// Hidden effects, in the exchange format and as summed changes to the arm.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace simulator {

/// A parameter in units of the exchange format (mm, deg, rad, ..), not in SI.
struct Parameter {
  std::string name;
  double value = 0.0;
  std::string unit;
  bool fixed = false;  ///< not changed by a fit
};

struct Effect {
  std::string id;
  std::vector<std::string> scope;
  std::vector<Parameter> parameters;
  std::string by;       ///< backlash: "load" or "move"
  std::string frame;    ///< step_event: "base" or "tool"
  std::string session;  ///< base_frame, tool_frame: session it applies to, or empty
};

using Effects = std::vector<Effect>;

nlohmann::json ToJson(const Effects& effects);
Effects EffectsFromJson(const nlohmann::json& list);

/// All effects summed, in SI units; vectors have one entry per joint.
struct Changes {
  struct Frame {
    std::string session;
    Eigen::Vector3d xyz_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d rpy_rad = Eigen::Vector3d::Zero();
    Eigen::Vector3d tip_m = Eigen::Vector3d::Zero();
  };
  struct Periodic {
    int joint;
    double amplitude_rad, cycles, phase_rad;
  };
  struct Drift {
    Eigen::Vector3d xyz_m;
    double time_constant_s;
  };
  struct Step {
    double time_s;
    Eigen::Vector3d xyz_m;
    bool of_tool;
  };
  struct Jump {
    double time_s;
    int joint;
    double by_rad;
  };
  struct Bump {
    int joint;
    double amplitude_rad, centre_rad, width_rad, second;
  };

  explicit Changes(int joints);
  Changes(const Effects& effects, int joints);

  Eigen::VectorXd offset, gear_ratio, compliance, hardening, backlash_load, backlash_move, lag,
      inertia, viscous_squared, warm_payload, following, friction, a_m, d_m, alpha_rad, beta_rad,
      bearing, link_bending, link_torsion, axis_bending, asymmetry;
  Eigen::VectorXd guide_x, guide_y;  ///< half the play of a guide about two axes across its travel
  Eigen::MatrixXd coupling;          ///< (i, j): coupling of joint i to the angle of joint j
  /// Sag of a joint with links of unknown mass [rad], for a weight acting with |g| across the
  /// joint.
  struct Sag {
    int joint, link, across;
    double size_rad;
  };
  std::vector<Sag> sags;
  /// From its event time on, the base is rotated about x and y of the measurement frame.
  struct Tilt {
    double time_s;
    Eigen::Vector2d turn_rad;
  };
  std::vector<Tilt> tilts;
  double tilt_gain = 0.0;  ///< base tilt divided by the inclinometer reading
  double range_zero_m = 0.0;
  Eigen::Vector3d anchor_m = Eigen::Vector3d::Zero();  ///< displacement of the range anchor
  std::vector<Frame> frames;
  std::vector<Periodic> periodics;
  std::vector<Drift> drifts;
  std::vector<Step> steps;
  std::vector<Jump> jumps;
  std::vector<Bump> bumps;
  double counterbalance_Nm = 0.0, counterbalance_phase_rad = 0.0;
  double tool_ratio = 0.0, shear_kappa = 0.0, root_compliance = 0.0;
  double mass_scale = 0.0, mass_constant_kg = 0.0;
  Eigen::Vector3d cog_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d gravity_rad = Eigen::Vector2d::Zero();
  /// Measuring camera: distances times 1 + tag_size; depths times 1 + stretch of a zoom from
  /// its event time on; actual minus calibrated k1.
  double tag_size = 0.0, lens_k1 = 0.0;
  struct Zoom {
    double time_s, stretch;
  };
  std::vector<Zoom> zooms;
  double pedestal = 0.0, thermal_per_K = 0.0, latency_s = 0.0, scale = 0.0;

  // Outside the catalogue of the exchange format.
  double creep = 0.0, creep_tau_s = 1.0;
  /// The link of a joint (0-based) grows by growth (1 - exp(-t / tau_s)), relative.
  struct Warmup {
    int joint;
    double growth, tau_s;
  };
  std::vector<Warmup> warmups;
  Eigen::Vector3d sine_m = Eigen::Vector3d::Zero();
  double sine_period_s = 1.0, sine_phase_rad = 0.0;
  double bending_per_kg = 0.0;
  double growth_mm_per_K2 = 0.0;
  Eigen::Vector3d pressure_m_per_bar = Eigen::Vector3d::Zero();
  /// Displacement of the base per 10 mbar, per 10 K and per product of both.
  Eigen::Vector3d weather_m[3] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                  Eigen::Vector3d::Zero()};
  Eigen::Vector3d warm_payload_m_per_K_kg = Eigen::Vector3d::Zero();  ///< displacement of the tip

 private:
  void Add(const Effect& effect);
  bool AddStructure(const Effect& effect);
  bool AddReading(const Effect& effect);
};

}  // namespace simulator
