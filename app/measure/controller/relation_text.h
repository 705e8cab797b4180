// Texts of an identification: the relation, what to write into the cell, what it means.
#pragma once

#include <string>
#include <vector>

#include "app/measure/controller/identify.h"

namespace plumbline::measure {

/// One place to change: lines of a cell or profile, or what to do where no line can say it.
struct CellLines {
  std::string place;               ///< "[robot], joint 3", "robot profile, [tcp]"; empty: no line
  std::vector<std::string> lines;  ///< "theta_offset_deg = -88.5"
  std::string advice;              ///< what they do, or what to do instead
};

/// "joint 3 counted against joint 2 (1.000 ± 0.001)"; relations joined by " and ".
std::string RelationText(const HypothesisFit& fit, const RelationContext& context);

/// The changes that make the relation nominal. A frame of the reported poses is none of the cell's:
/// it is to be changed in the controller.
/// @param cell  receives the changed robot and tool
std::vector<CellLines> LinesOf(const HypothesisFit& fit, const RelationContext& context,
                               const ControllerSample& sample, model::CellModel& cell);

/// True if a cell can hold all of the relation: changed lines alone make it nominal.
bool CellCanHold(const HypothesisFit& fit);

/// What was found, in one sentence: "the controller uses ..".
std::string FindingText(const Identification& found, const RelationContext& context);
/// What to do about it, in one sentence; empty if the relation is nominal.
std::string FindingRemedy(const Identification& found, const RelationContext& context,
                          const ControllerSample& sample);

/// The rows of `joint` of a robot in a cell file: "{ a_mm = 0.0, alpha_deg = 90.0, .. }".
std::vector<std::string> JointRows(const model::Robot& robot);
/// `[{ joint = 3, of = 2, ratio = 1.0 }]`
std::string CouplingText(const model::Robot& robot);

}  // namespace plumbline::measure
