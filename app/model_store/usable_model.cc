#include "app/model_store/usable_model.h"

#include <fmt/format.h>

#include "firmware-like/effects/catalogue.h"

namespace plumbline {

std::optional<std::string> WhyNotUsable(const CellModel& cell) {
  for (const WrittenEffect& written : cell.effects) {
    const Effect* effect = FindEffect(written.id);
    std::string word;
    for (const EffectParameter& parameter : written.parameters) {
      if (!parameter.word.empty()) word = parameter.word;
    }
    if (effect == nullptr || effect->traits().Needs(Signal::kOrder, word)) {
      return fmt::format(
          "its effect \"{}\" depends on the robot's last moves, which are not known "
          "of a point it has yet to go to",
          written.id);
    }
  }
  return std::nullopt;
}

}  // namespace plumbline
