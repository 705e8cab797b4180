// Contributions of effects in which each value belongs to one joint.
#pragma once

#include <initializer_list>

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Adds each value times `factor(joint)` to one entry of its joint.
template <typename T, typename Factor>
void AddToJoints(typename Influence<T>::JointEntry entry, const EffectTerm& term,
                 std::span<const T> values, Influence<T>& influence, const Factor& factor) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const int joint = term.parameters[k].joint;
    influence.Joint(entry, joint) += values[k] * factor(joint);
  }
}

/// Adds each value to its joint, in the entry assigned to the value's spec.
template <typename T>
void AddToJoints(std::initializer_list<typename Influence<T>::JointEntry> entry_of_spec,
                 const EffectTerm& term, std::span<const T> values, Influence<T>& influence) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const TermParameter& parameter = term.parameters[k];
    influence.Joint(entry_of_spec.begin()[parameter.spec], parameter.joint) += values[k];
  }
}

/// Element of a signal for one joint; 0 if it was not recorded.
inline double OfJoint(const model::JointVector& signal, int joint) {
  return signal.size() > joint ? signal[joint] : 0;
}

}  // namespace plumbline::effects
