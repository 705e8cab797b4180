#include "app/base/config/linear_theory.h"

#include <fmt/format.h>

#include "firmware-like/deflection/linear_range.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::config {

std::string BeyondLinearTheory(const model::CellModel& cell, const deflection::LoadedArm& arm,
                               const deflection::LoadedState& state) {
  std::string text;
  const double bend = deflection::BendShare(arm, state);
  if (bend > deflection::kLargestLinearBend) {
    text = fmt::format(
        "the tool bends by {:.3g} % of its length; linear beam theory holds up to {:g} % and "
        "neglects up to {:.3g} mm here, which an unmeasured radius includes. Use a stiffer tool or "
        "a lighter load, or measure at this load",
        100 * bend, 100 * deflection::kLargestLinearBend,
        kMmPerMetre * deflection::NeglectedByLinearTheory(arm, state));
  }
  const auto yield = deflection::YieldShare(cell.ToolAt(state.tool.payload.tool), state);
  if (yield && *yield > 1) {
    if (!text.empty()) text += "; ";
    text += fmt::format(
        "the stress in the tool is {:.0f} % of yield_MPa: it bends permanently, and no prediction "
        "holds. Reduce the load or use a stronger tool",
        100 * *yield);
  }
  return text;
}

}  // namespace plumbline::config
