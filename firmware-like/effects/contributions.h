// Contributions that several effects have in common.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

using Entries = Influence<double>;

/// Add() of an effect whose parameters are entries of the influence: parameter k adds to entry
/// kFirst + k, which belongs to the parameter's joint if kFirst is a JointEntry.
template <int kFirst>
struct AddsFrom {
  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      const int entry = kFirst + parameter.spec;
      influence[kFirst < Entries::kJointEntries ? entry * model::kMaxJoints + parameter.joint
                                                : entry] += values[k];
    }
  }
};

/// Adds each value times `factor(joint)` to one entry of its joint.
template <typename T, typename Factor>
void AddToJoints(typename Influence<T>::JointEntry entry, const EffectTerm& term,
                 std::span<const T> values, Influence<T>& influence, const Factor& factor) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const int joint = term.parameters[k].joint;
    influence.Joint(entry, joint) += values[k] * factor(joint);
  }
}

/// Element of a signal for one joint; 0 if it was not recorded.
inline double OfJoint(const model::JointVector& signal, int joint) {
  return signal.size() > joint ? signal[joint] : 0;
}

/// True if the event time of a term, its `time` [s] or `row`, has been reached under these
/// conditions.
template <typename T>
bool HasHappened(const EffectTerm& term, std::span<const T> values, const Conditions& conditions) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const ParameterSpec& spec = term.effect->traits().parameters[term.parameters[k].spec];
    if (!IsEventTime(spec)) continue;
    const std::optional<double>& now = spec.name == "time" ? conditions.t_s : conditions.row;
    if (now && *now >= values[k]) return true;
  }
  return false;
}

}  // namespace plumbline::effects
