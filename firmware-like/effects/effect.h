// Interface of a physical effect: required signals, parameters, and its contribution to the arm.
#pragma once

#include <ceres/jet.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware-like/effects/influence.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::effects {

/// Dual number with kDualWidth derivatives, for identification by automatic differentiation.
inline constexpr int kDualWidth = 16;
using Dual = ceres::Jet<double, kDualWidth>;

/// Signals, besides joint positions, that an effect depends on. Rows without them carry no
/// information about the effect.
enum class Signal {
  kTime,          ///< t_s
  kTemperature,   ///< temp_C, and the cell's reference temperature
  kVelocity,      ///< qd
  kAcceleration,  ///< qdd
  kOrder,         ///< execution order of the rows, which defines the last moves
  kPayload,       ///< payload_kg and the cell's [payload]
  kTorques,       ///< link masses, or measured torques
  kWeight,        ///< link masses; structural loads are not measured by torque sensors
  kNoTorques,     ///< torques are unknown; for effects that replace them
  kBeam,          ///< a tool that bends
  kCamera,        ///< a measuring camera with a declared pose in W
  kRange,         ///< measured distances from an anchor
  kTilt,          ///< varying tilt_x_deg and tilt_y_deg of an inclinometer on the base
  kCameras,       ///< points measured by different cameras, or by a camera and another instrument
};

/// Role of a parameter in its effect.
enum class ParameterRole {
  kSize,   ///< zero means no effect; the effect is linear in its sizes near zero
  kShape,  ///< where or how the effect acts: phase, cycles per turn, time constant, event time
  kWord,   ///< a choice: `by` of backlash, `frame` of step_event
};

/// Specification of a parameter as it appears in files. In `name`, each `#` stands for a number.
/// The first one is a joint number. The second one is the number of a joint inboard of the first if
/// it follows `q`, the number of the joint's own link or of one outboard of it if it follows
/// `link`, and otherwise a term index starting at 2.
struct ParameterSpec {
  std::string_view name{};
  std::string_view unit{};  ///< in files
  double to_SI = 1;         ///< SI value passed to Add() = file value * to_SI
  /// For a size, the values that a sound machine can have, in file units; a value beyond them is
  /// implausible as an explanation. For a shape, the search range. For an inverse parameter,
  /// infinity is plausible too.
  model::Interval plausible{-1e300, 1e300};
  ParameterRole role = ParameterRole::kSize;
  std::string_view words{};  ///< for kWord: comma-separated choices; the first one is the default
  bool inverse = false;      ///< the SI value is 1 / (file value); absent means infinite (kappa)
  /// For a size that acts nonlinearly: the value whose effect equals `linear` times the derivative
  /// at zero. Null if the size acts linearly: that value is then `linear` itself.
  double (*value_of_linear)(double linear) = nullptr;
  /// Considered between parallel axes only; elsewhere it is equivalent to other parameters.
  bool parallel_axes_only = false;
  std::optional<model::JointType> only{};  ///< for joints of this type only
  bool not_of_first = false;  ///< not for the first joint, where another effect is equivalent
  /// Unit and range for prismatic joints, if they differ; to_SI is the same.
  std::string_view prismatic_unit{};
  model::Interval prismatic_plausible{};
  /// With this choice of the effect's word, a negative value would let the joint yield against its
  /// load: zero is then the lower end of the plausible range.
  std::string_view not_negative_with{};
};

/// True for the event time (`time` or `row`) from which an effect acts: a threshold without
/// derivative.
bool IsEventTime(const ParameterSpec& spec);
/// True for a parameter that relates two joints: its name has a second `q#`.
bool IsOfTwoJoints(const ParameterSpec& spec);
/// True for a parameter of a joint and a link outboard of it: its name has `link#`.
bool IsOfJointAndLink(const ParameterSpec& spec);
/// True for the number of cycles per turn of an effect that repeats with the joint angle.
bool IsCycles(const ParameterSpec& spec);

/// Identifies one parameter of a term: its spec, its joint (0-based, -1 for none), its harmonic
/// (from 1) and the second joint or link.
struct TermParameter {
  int spec = 0;
  int joint = -1;
  int harmonic = 1;
  int of = -1;  ///< second joint or link ("q3_of_q2", "q2_link3_x"), 0-based; -1: none
  bool operator==(const TermParameter&) const = default;
};

class Effect;

/// The prismatic joints of a robot as bits; see EffectTerm.
std::uint32_t PrismaticJoints(const model::Robot& robot);
/// Unit and plausible range of a parameter for one joint.
std::string_view UnitOf(const ParameterSpec& spec, std::uint32_t prismatic, int joint);
/// @param word  of the effect, see EffectTerm
model::Interval PlausibleOf(const ParameterSpec& spec, std::string_view word,
                            std::uint32_t prismatic, int joint);

/// An effect with the parameters in use. The numeric values are stored separately, in SI units and
/// in this order. A kWord parameter has no entry in `parameters`; `word` holds its choice.
struct EffectTerm {
  const Effect* effect = nullptr;
  std::vector<TermParameter> parameters;
  std::string_view word{};             ///< one of the spec's words; empty: the first one
  std::uint32_t prismatic = 0;         ///< bit k: joint k is prismatic, which may change units
  std::vector<std::string> drivers{};  ///< of an empirical term: the columns it depends on
  Eigen::MatrixXd nodes{};             ///< of an empirical term, in file units; see empirical.h
};

/// Additional signal required by one choice of a word.
struct VariantSignal {
  std::string_view word;
  Signal signal;
};

/// Frame that may be unknown in a measurement; every fit then estimates it.
enum class Nuisance { kNone, kBaseFrame, kToolFrame };

/// Description of an effect, used by configuration, diagnosis and report.
struct EffectTraits {
  std::string_view id;
  std::string_view meaning;  ///< one sentence for the report: the cause on the machine
  std::string_view remedy;   ///< one sentence for the report: what to do about it
  // For docs/effects.md, which defines the symbols of the formula.
  std::string_view formula{};     ///< what the effect adds to the model
  std::string_view shown_by{};    ///< rows that separate it from what it is confused with
  std::string_view sound_size{};  ///< on a sound machine, with its source; empty: none is known
  std::vector<ParameterSpec> parameters;
  std::vector<Signal> needs;
  std::vector<VariantSignal> word_needs{};
  std::vector<std::string_view> confused_with;  ///< ids
  /// Joints are accepted or rejected individually, and the scope of the result lists them.
  bool per_joint = false;
  /// Parameters are accepted or rejected individually, although they belong to no joint.
  bool independent_parameters = false;
  std::string_view name{};  ///< for use in sentences; empty: the id with spaces
  Nuisance nuisance = Nuisance::kNone;
  /// A parameter adds to the declared compliance of its joint; the sum of a passive joint must not
  /// be negative.
  bool adds_compliance = false;
  bool empirical = false;  ///< a curve along a recorded signal without physical model
  /// Revolute joints: largest rotation seen on real arms [rad]; 0 if no source is known.
  double largest_observed_rotation_rad = 0;
  /// Caused by the arm itself, not by its tool, load, floor or instrument, so that it may be
  /// similar in all arms of one model (app/measure/siblings).
  bool of_arm = false;
  /// Each arm has a size of its own, zero on average over the arms of one model, as its mastering
  /// leaves it.
  bool zero_mean_over_arms = false;

  /// The word names the camera whose rows the effect changes; see Conditions::camera_name.
  bool of_one_camera = false;

  /// True if only rows with `signal` carry information about the effect with that word.
  bool Needs(Signal signal, std::string_view word = {}) const;
};

/// Base class of the effects. The catalogue holds one stateless object of each.
class Effect {
 public:
  virtual ~Effect() = default;
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  const EffectTraits& traits() const { return traits_; }

  /// Adds the contribution of the effect under these conditions; adds nothing if a required signal
  /// is absent. Does not allocate.
  /// @param values  values of term.parameters, in SI units
  virtual void Add(const EffectTerm& term, std::span<const double> values,
                   const Conditions& conditions, Influence<double>& influence) const = 0;
  /// The same with derivatives; the values are identical.
  virtual void Add(const EffectTerm& term, std::span<const Dual> values,
                   const Conditions& conditions, Influence<Dual>& influence) const = 0;

 protected:
  explicit Effect(EffectTraits traits) : traits_(std::move(traits)) {}

 private:
  EffectTraits traits_;
};

/// Adapts a struct with `static EffectTraits Traits()` and a template `static void Add<T>(term,
/// std::span<const T>, conditions, Influence<T>&)` to the Effect interface.
template <typename Formula>
class EffectOf final : public Effect {
 public:
  EffectOf() : Effect(Formula::Traits()) {}
  void Add(const EffectTerm& term, std::span<const double> values, const Conditions& conditions,
           Influence<double>& influence) const override {
    Formula::template Add<double>(term, values, conditions, influence);
  }
  void Add(const EffectTerm& term, std::span<const Dual> values, const Conditions& conditions,
           Influence<Dual>& influence) const override {
    Formula::template Add<Dual>(term, values, conditions, influence);
  }
};

/// The value of parameter `spec` with the same joint and harmonic as parameter k; `otherwise` if
/// the term has none.
template <typename T>
T ValueOfSame(const EffectTerm& term, std::span<const T> values, std::size_t k, int spec,
              const T& otherwise) {
  const TermParameter& own = term.parameters[k];
  for (std::size_t other = 0; other < values.size(); ++other) {
    if (term.parameters[other] == TermParameter{spec, own.joint, own.harmonic})
      return values[other];
  }
  return otherwise;
}

}  // namespace plumbline::effects
