// Fuzzer: arbitrary bytes as URDF or as a UR's calibration: faults, or a cell that has the file's
// forward kinematics and a corrected file that is read back.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "app/base/config/cell_reader.h"
#include "app/measure/urdf/cell_text.h"
#include "app/measure/urdf/chain_difference.h"
#include "app/measure/urdf/corrected_urdf.h"
#include "app/measure/urdf/dh_table.h"
#include "app/measure/urdf/factory_table.h"

using namespace plumbline;

namespace {

/// Distances that the rounding of the file's digits cannot exceed on an arm of a hundred metres.
constexpr double kFarthest_m = 1e-5;
constexpr double kLargestAngle = 1e-6;

void CheckCell(const measure::JointChain& chain) {
  config::FaultList faults;
  const model::Robot robot = measure::RobotFromChain(chain);
  const auto cell =
      config::CellFromText(measure::CellText(robot, chain, "fuzz"), "cell.toml", faults);
  if (!cell) return;  // lengths and masses may add up to more than a cell may have
  const auto difference = DifferenceOf(chain, cell->robot, measure::RandomPostures(cell->robot, 3));
  if (!(difference.distance_m < kFarthest_m && difference.angle_rad < kLargestAngle)) std::abort();
}

void CheckExport(const measure::UrdfFile& file, const measure::JointChain& chain,
                 std::string_view text) {
  const model::Robot declared = measure::RobotFromChain(chain);
  model::Robot corrected = declared;
  corrected.joints.front().a_m += 1e-3;
  const auto origins = measure::CorrectedOriginsOf(file, chain, declared, corrected);
  if (!origins) return;
  config::FaultList faults;
  const std::string written = measure::UrdfWithOrigins(text, origins->origins);
  if (!measure::UrdfFromText(written, "out.urdf", faults)) {
    // A length at the limit may have been moved beyond it.
    if (config::FaultsText(faults).find("is outside") == std::string::npos) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  config::FaultList faults;
  if (measure::IsFactoryTable(text)) {
    const auto chain =
        measure::ChainFromFactoryTable(text, "k.yaml", measure::TableAngles::kRollPitchYaw, faults);
    if (chain.has_value() == faults.HasFaults()) std::abort();
    if (chain) CheckCell(*chain);
    return 0;
  }
  const auto file = measure::UrdfFromText(text, "r.urdf", faults);
  if (file.has_value() == faults.HasFaults()) std::abort();
  if (!file) return 0;
  const auto chain =
      measure::ChainFromUrdf(*file, "r.urdf", "", "", measure::Rising::kIgnored, faults);
  if (chain.has_value() == faults.HasFaults()) std::abort();
  if (!chain) return 0;
  CheckCell(*chain);
  if (size % 8 == 0) CheckExport(*file, *chain, text);  // compares 1000 postures
  return 0;
}
