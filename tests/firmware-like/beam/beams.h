// Beams shared by several tests.
#pragma once

#include <utility>
#include <vector>

#include "firmware-like/beam/beam.h"

namespace plumbline::test {

inline constexpr model::Material kSteel{210e9, 0.3, 7850};
inline constexpr model::Material kAluminium{70e9, 0.33, 2700};

inline model::Tool BeamTool(std::vector<model::ToolSegment> segments,
                            model::BeamTheory theory = model::BeamTheory::kEulerBernoulli) {
  model::Tool tool;
  tool.rigid = false;
  tool.theory = theory;
  tool.segments = std::move(segments);
  tool.tcp_F = Vec3(0, 0, tool.Length());
  return tool;
}

/// Different in x and y, to reveal swapped axes.
inline model::Tool UniformTool(model::BeamTheory theory = model::BeamTheory::kEulerBernoulli) {
  return BeamTool({{0.9, model::RectangleSection(0.03, 0.05), kSteel}}, theory);
}

inline model::Tool SteppedTool(model::BeamTheory theory = model::BeamTheory::kEulerBernoulli) {
  return BeamTool({{0.4, model::SquareTubeSection(0.08, 0.005), kSteel},
                   {0.3, model::TubeSection(0.06, 0.004, 0.33), kAluminium},
                   {0.25, model::RectangleSection(0.02, 0.04), kSteel}},
                  theory);
}

}  // namespace plumbline::test
