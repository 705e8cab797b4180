#include "firmware-like/effects/effect.h"

#include <algorithm>

namespace plumbline {

bool IsMoment(const ParameterSpec& spec) {
  return spec.role == ParameterRole::kShape && (spec.name == "time" || spec.name == "row");
}

bool IsOfTwoJoints(const ParameterSpec& spec) {
  return spec.name.rfind("q#") != spec.name.find("q#");
}

bool IsCycles(const ParameterSpec& spec) {
  return spec.role == ParameterRole::kShape && spec.unit == "1/turn";
}

bool EffectTraits::Needs(Signal signal, std::string_view word) const {
  return std::find(needs.begin(), needs.end(), signal) != needs.end() ||
         std::any_of(word_needs.begin(), word_needs.end(), [&](const WordNeed& need) {
           return need.word == word && need.signal == signal;
         });
}

}  // namespace plumbline
