// A physical effect: what it needs, its parameters, and how it adds to the arm.
#pragma once

#include <ceres/jet.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware-like/effects/influence.h"
#include "firmware-like/geometry/angle.h"

namespace plumbline {

/// A number with kDualWidth derivatives, for identification.
inline constexpr int kDualWidth = 16;
using Dual = ceres::Jet<double, kDualWidth>;

/// What an effect reads beside the joint positions; a row without it cannot show the effect.
enum class Signal {
  kTime,          ///< t_s
  kTemperature,   ///< temp_C, and the cell's reference temperature
  kVelocity,      ///< qd
  kAcceleration,  ///< qdd
  kOrder,         ///< the order of execution: last moves
  kPayload,       ///< payload_kg and the cell's [payload]
  kTorques,       ///< link masses, or measured torques
  kWeight,        ///< link masses: what the structure bears, no torque sensor measures
  kNoTorques,     ///< neither, so that what yields to torque cannot be told apart by it
  kBeam,          ///< a tool that bends
  kCamera,        ///< a measuring camera whose pose in W is declared
  kRange,         ///< distances from an anchor are measured
  kTilt,          ///< tilt_x_deg and tilt_y_deg of an inclinometer on the base, not constant
};

/// How a parameter enters.
enum class ParameterRole {
  kSize,   ///< zero means "does not act"; the effect is linear in its sizes near zero
  kShape,  ///< where or how it acts: a phase, cycles a turn, a time constant, a moment
  kWord,   ///< a choice: `by` of backlash, `frame` of step_event
};

/// A parameter of the file formats. In `name`, `#` stands for a number, the first that of a joint;
/// the second one of another joint inwards of it where it follows a `q`, of a link from its own
/// outwards where it follows `link`, else a count from 2.
struct ParameterSpec {
  std::string_view name{};
  std::string_view unit{};  ///< as in the files
  double to_SI = 1;         ///< file value times this is the SI value that Add() gets
  /// Sizes that a sound machine can show, in file units; beyond them an explanation is
  /// implausible. For a shape, the range to search. Of an inverse one, infinite is plausible too.
  Interval plausible{-1e300, 1e300};
  ParameterRole role = ParameterRole::kSize;
  std::string_view words{};  ///< of a kWord: its choices, comma-separated; the first if not said
  bool inverse = false;      ///< the SI value is 1 / (file value): absent is infinite (kappa)
  /// Of a size that does not act linearly: the value that acts as `linear` times the derivative at
  /// zero does. Null: the size is linear, that value is `linear` itself.
  double (*value_of_linear)(double linear) = nullptr;
  /// True where the parameter makes sense between parallel axes only; elsewhere others imitate it.
  bool parallel_axes_only = false;
  std::optional<JointType> only{};  ///< joints of this type only
  bool not_of_first = false;  ///< of the first joint another effect of the catalogue does the same
  /// Of the last joint it moves the tip within the flange, as another effect of the catalogue does:
  /// never, always, or in the distal convention, where the link follows the joint.
  enum class MovesTip { kNever, kAlways, kIfDistal };
  MovesTip tip_of_last = MovesTip::kNever;
  /// Of a prismatic joint, where it has another unit than a revolute one; to_SI is the same.
  std::string_view prismatic_unit{};
  Interval prismatic_plausible{};
};

/// True of the moment (`time` or `row`) from which an effect acts: a threshold, without derivative.
bool IsMoment(const ParameterSpec& spec);
/// True of a parameter between two joints: its name has a second `q#`.
bool IsOfTwoJoints(const ParameterSpec& spec);
/// True of a parameter of a joint and a link outboard of it: its name has `link#`.
bool IsOfJointAndLink(const ParameterSpec& spec);
/// True of the cycles a turn of an effect that repeats with a joint's angle.
bool IsCycles(const ParameterSpec& spec);

/// One parameter of a term: which spec, of which joint (0-based; -1: none), which of several terms
/// of one joint (harmonics count from 1), and with which second joint.
struct TermParameter {
  int spec = 0;
  int joint = -1;
  int harmonic = 1;
  int of = -1;  ///< second joint or link ("q3_of_q2", "q2_link3_x"), 0-based; -1: none
  bool operator==(const TermParameter&) const = default;
};

class Effect;

/// The prismatic joints of a robot as bits; see EffectTerm.
std::uint32_t PrismaticJoints(const Robot& robot);
/// Unit and plausible range of a parameter of that joint.
std::string_view UnitOf(const ParameterSpec& spec, std::uint32_t prismatic, int joint);
const Interval& PlausibleOf(const ParameterSpec& spec, std::uint32_t prismatic, int joint);

/// An effect with the parameters that are in use; values stand beside it, in SI, in this order.
/// Words are no numbers: `word` holds the choice, and it has no entry here.
struct EffectTerm {
  const Effect* effect = nullptr;
  std::vector<TermParameter> parameters;
  std::string_view word{};             ///< one of the spec's words; empty stands for its first
  std::uint32_t prismatic = 0;         ///< bit k: joint k is prismatic, which may change units
  std::vector<std::string> drivers{};  ///< of an empirical term: the column that it follows
  Eigen::MatrixXd nodes{};             ///< of an empirical term, in file units; see empirical.h
};

/// What a word's choice needs beside what the effect needs.
struct WordNeed {
  std::string_view word;
  Signal signal;
};

/// A frame that a measurement may leave unknown, so that every fit estimates it anyway.
enum class Nuisance { kNone, kBaseFrame, kToolFrame };

/// What the catalogue tells of an effect.
struct EffectTraits {
  std::string_view id;
  std::string_view meaning;  ///< one sentence for the report: what it is on the machine
  std::string_view remedy;   ///< one sentence for the report: what to do about it
  std::vector<ParameterSpec> parameters;
  std::vector<Signal> needs;
  std::vector<WordNeed> word_needs{};
  std::vector<std::string_view> confused_with;  ///< ids
  /// True where joints are judged one by one, and the answer's scope names them.
  bool per_joint = false;
  /// True where its parameters are kept or dropped one by one, although they belong to no joint.
  bool one_by_one = false;
  std::string_view name{};  ///< in sentences; empty: the id with spaces
  Nuisance nuisance = Nuisance::kNone;
  /// True where a parameter adds to the declared compliance of its joint: the sum is not negative
  /// in any passive joint.
  bool adds_compliance = false;
  bool empirical = false;  ///< a curve along a recorded signal, no physics
  /// Of revolute joints: the largest turn that real arms show [rad]; 0: no source says.
  double seen_turn_rad = 0;

  /// Whether a row must have `signal` to show the effect with that word.
  bool Needs(Signal signal, std::string_view word = {}) const;
};

/// The base of every effect; one object each in the catalogue, without state.
class Effect {
 public:
  virtual ~Effect() = default;
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  const EffectTraits& traits() const { return traits_; }

  /// Adds what the effect does in these conditions; nothing where a signal it needs is absent.
  /// Allocates nothing.
  /// @param values  of term.parameters, in SI
  virtual void Add(const EffectTerm& term, std::span<const double> values,
                   const Conditions& conditions, Influence<double>& influence) const = 0;
  /// The same with derivatives; identical in its values.
  virtual void Add(const EffectTerm& term, std::span<const Dual> values,
                   const Conditions& conditions, Influence<Dual>& influence) const = 0;

 protected:
  explicit Effect(EffectTraits traits) : traits_(std::move(traits)) {}

 private:
  EffectTraits traits_;
};

/// Makes an Effect of a struct with `static EffectTraits Traits()` and a template
/// `static void Add<T>(term, std::span<const T>, conditions, Influence<T>&)`.
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

/// The value of the parameter `spec` that belongs to parameter k: of its joint and its harmonic.
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

}  // namespace plumbline
