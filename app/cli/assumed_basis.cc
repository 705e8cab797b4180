#include "app/cli/assumed_basis.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/deflection/priors.h"

namespace plumbline::cli {
namespace {

/// Adds "link_mass_kg of joints 2 and 3", or of all joints, unless no joint lacks the key.
template <typename Lacks>
void AddJointsThatLack(const char* key, int joints, Lacks lacks, std::vector<std::string>& list) {
  std::vector<std::string> numbers;
  for (int i = 0; i < joints; ++i) {
    if (lacks(static_cast<std::size_t>(i))) numbers.push_back(std::to_string(i + 1));
  }
  if (numbers.empty()) return;
  if (static_cast<int>(numbers.size()) == joints) {
    list.push_back(fmt::format("{} of all joints", key));
  } else {
    list.push_back(fmt::format("{} of joint{} {}", key, numbers.size() == 1 ? "" : "s",
                               measure::Listed(numbers)));
  }
}

std::vector<std::string> Undeclared(const model::CellModel& cell,
                                    const measure::MeasuredTable& poses,
                                    const deflection::DeflectionPriors& priors) {
  std::vector<std::string> list;
  const int joints = cell.robot.size();
  AddJointsThatLack(
      "compliance_rad_per_Nm", joints,
      [&](std::size_t k) { return priors.compliance[k].has_value(); }, list);
  AddJointsThatLack(
      "link_mass_kg", joints, [&](std::size_t k) { return priors.links[k].mass_sigma_ln > 0; },
      list);
  AddJointsThatLack(
      "link_com_mm", joints, [&](std::size_t k) { return !priors.links[k].com_sd_L.isZero(0); },
      list);
  if (!cell.payload_cog_F && cell.payload_items.empty()) {
    list.emplace_back("[payload]");
  } else if (!poses.recorded.payload && !poses.recorded.item) {
    list.emplace_back("payload_kg of the poses");
  }
  return list;
}

/// What the radii rest on if the cell declares all joints, links and the payload.
std::vector<std::string> Assumptions(const deflection::DeflectionPriors& priors,
                                     bool deviation_stated) {
  std::vector<std::string> list;
  if (priors.root_tilt_rad) list.emplace_back("a typical compliance of the tool's coupling");
  if (priors.base_compliance_rad_per_Nm) {
    list.emplace_back("a typical compliance of the robot's pedestal");
  }
  list.emplace_back("a typical uncertainty of the payload's mass and centre of gravity");
  if (!deviation_stated) {
    list.emplace_back(
        "a deviation of the declared deflections that is not stated "
        "(--deflection-sd)");
  }
  return list;
}

}  // namespace

std::string AssumedBasisText(const model::CellModel& cell, const measure::MeasuredTable& poses,
                             bool deviation_stated) {
  const deflection::LoadedArm arm(cell);
  const deflection::DeflectionPriors priors = deflection::PriorsOf(cell, arm);
  const std::vector<std::string> undeclared = Undeclared(cell, poses, priors);
  // A fitted model has assumed radii where it is extrapolated, or if it was edited since.
  const std::string measure =
      cell.domain ? "measure points in this region and run `plumbline diagnose` again"
                  : "fit the model to measured points with `plumbline diagnose`";
  if (!undeclared.empty()) {
    return fmt::format("typical values replace what the cell does not declare. Declare {}, or {}",
                       measure::Listed(undeclared), measure);
  }
  return fmt::format(
      "the cell declares its joints, links and payload; the radii rest on {}. To replace the "
      "assumptions, {}",
      measure::Listed(Assumptions(priors, deviation_stated)), measure);
}

}  // namespace plumbline::cli
