#include "app/measure/diagnosis/unit_changes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/measure/diagnosis/column_units.h"
#include "app/measure/diagnosis/payload_unit_changes.h"
#include "app/measure/diagnosis/unit_segment.h"
#include "firmware-like/geometry/angle.h"

namespace plumbline::measure {
namespace {

constexpr double kMinContrast = 5;  // minimum ratio of the largest angle to one turn in radians

/// The segment on one side in which a joint remains within one turn if read as radians; nullopt
/// unless the other side exceeds this by far.
std::optional<RowSegment> SegmentWithinOneTurn(const Dataset& data, int joint, bool from) {
  constexpr double kTurn_rad = 2 * std::numbers::pi * kRadPerDeg;  // radians read as degrees
  const int rows = data.rows();
  int length = 0;
  double beyond = 0;
  for (int k = 0; k < rows; ++k) {
    const RowIndex row(from ? rows - 1 - k : k);
    const double size = std::abs(data.measured(row).q[joint]);
    if (beyond == 0 && size <= kTurn_rad) {
      ++length;
    } else {
      beyond = std::max(beyond, size);
    }
  }
  const RowSegment segment{RowIndex(from ? rows - length : length), from};
  if (!segment.IsLong(rows) || beyond < kMinContrast * kTurn_rad) return std::nullopt;
  return segment;
}

void AddJointChanges(const Dataset& data, std::vector<Mistake>& mistakes) {
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    if (!IsRevolute(data, joint)) continue;
    for (const bool from : {true, false}) {
      const std::optional<RowSegment> segment = SegmentWithinOneTurn(data, joint, from);
      if (segment) mistakes.push_back(SubtleChange(InRadians(joint), LinesOf(data, *segment)));
    }
  }
}

}  // namespace

std::vector<Mistake> UnitChanges(const Dataset& data) {
  std::vector<Mistake> mistakes;
  AddJointChanges(data, mistakes);
  if (!UsesPayload(data)) return mistakes;
  for (Mistake& change : PayloadUnitChanges(data)) mistakes.push_back(std::move(change));
  return mistakes;
}

}  // namespace plumbline::measure
