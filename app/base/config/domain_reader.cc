#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/config/cell_reader.h"
#include "app/base/config/limits.h"
#include "app/base/config/model_fingerprint.h"
#include "app/base/text/text.h"

namespace plumbline::config {
namespace {

constexpr NumberRange kDistantSigma{0, 10000, kMetrePerMm};  // per radian of distance
constexpr NumberRange kLargestResidual{0, 100000, kMetrePerMm};
constexpr NumberRange kReach{0, 1000};  // prismatic joints contribute metres

/// An interval `[low, high]`; adds a fault if the ends are swapped.
std::optional<model::Interval> IntervalFrom(const TomlTable& table, std::string_view key,
                                            NumberRange range) {
  const auto values = table.Numbers(key, range, 2);
  if (!values) return std::nullopt;
  if ((*values)[0] > (*values)[1]) table.AddFault(key, "has its lower end above its upper end");
  return model::Interval{(*values)[0], (*values)[1]};
}

/// Reads the measured poses, the growth of the residual with distance from them and the fading of
/// the correction; none is meaningful without the poses.
void ReadDistance(const TomlTable& table, const model::Robot& robot, model::Domain& domain) {
  domain.distant_sigma_m = table.Number("distant_sigma_mm", kDistantSigma);
  const auto poses = table.Rows("poses_deg", {-100000, 100000});
  for (const auto& [key, other] :
       {std::pair{"distant_sigma_mm", "poses_deg"}, std::pair{"poses_deg", "distant_sigma_mm"}}) {
    if (table.Has(key) && !table.Has(other)) {
      table.AddFault(key, fmt::format("requires {}", other));
    }
  }
  if (table.Has("distant_sigma_mm") && !table.Has("residual_sigma_mm")) {
    table.AddFault("distant_sigma_mm", "requires residual_sigma_mm");
  }
  domain.reach_rad = table.Number("reach_rad", kReach).value_or(0);
  domain.declared_sigma_m = table.Number("declared_sigma_mm", kDistantSigma);
  for (const char* key : {"reach_rad", "declared_sigma_mm"}) {
    if (table.Has(key) && !table.Has("distant_sigma_mm")) {
      table.AddFault(key, "requires distant_sigma_mm");
    }
  }
  if (!poses) return;
  if (poses->rows() == 0 || poses->cols() != robot.size()) {
    table.AddFault("poses_deg",
                   fmt::format("is not a list of poses of {} joints each", robot.size()));
    return;
  }
  for (Eigen::Index pose = 0; pose < poses->rows(); ++pose) {
    model::JointVector& q = domain.poses.emplace_back(poses->row(pose).transpose());
    for (int i = 0; i < robot.size(); ++i) {
      const model::JointType type = robot.joints[static_cast<std::size_t>(i)].type;
      q[i] *= type == model::JointType::kPrismatic ? kMetrePerMm : kRadPerDeg;
    }
  }
}

std::vector<model::JointCombination> CombinationsFrom(const TomlTable& table, int joints) {
  constexpr const char* kKey = "joint_combinations";
  std::vector<model::JointCombination> combinations;
  const auto rows = table.Rows(kKey, {-100000, 100000});
  if (!rows) return combinations;
  if (rows->cols() != joints + 2) {
    table.AddFault(kKey, fmt::format("is not a list of {} weights and a range [deg] each", joints));
    return combinations;
  }
  for (Eigen::Index row = 0; row < rows->rows(); ++row) {
    const double low = (*rows)(row, joints), high = (*rows)(row, joints + 1);
    if (low > high) {
      table.AddFault(kKey, fmt::format("has the lower end of the range of combination {} above its "
                                       "upper end",
                                       row + 1));
    }
    combinations.push_back(
        {rows->row(row).head(joints).transpose(), {low * kRadPerDeg, high * kRadPerDeg}});
  }
  return combinations;
}

std::vector<model::JointLoad> JointLoadsFrom(const TomlTable& table, int joints) {
  constexpr const char* kKey = "joint_loads_Nm";
  std::vector<model::JointLoad> loads;
  const auto rows = table.Rows(kKey, {-1e9, 1e9});
  if (!rows) return loads;
  if (rows->cols() != 3) {
    table.AddFault(kKey, "is not a list of [joint, lowest load, highest load]");
    return loads;
  }
  for (Eigen::Index row = 0; row < rows->rows(); ++row) {
    const double number = (*rows)(row, 0), low = (*rows)(row, 1), high = (*rows)(row, 2);
    if (number != std::floor(number) || number < 1 || number > joints) {
      table.AddFault(kKey, fmt::format("names joint {:g}; the joints are 1 to {}", number, joints));
      continue;
    }
    const auto joint = static_cast<int>(number) - 1;
    if (low > 0 || high < 0) {
      table.AddFault(kKey, fmt::format("has a range of joint {} without 0", joint + 1));
    }
    if (std::any_of(loads.begin(), loads.end(),
                    [&](const model::JointLoad& load) { return load.joint == joint; })) {
      table.AddFault(kKey, fmt::format("has joint {} twice", joint + 1));
    }
    loads.push_back({joint, {low, high}});
  }
  return loads;
}

/// The residual of held-out rows is valid only for the exact model that was validated with them.
void CheckFingerprint(const TomlTable& table, const TomlDocument& document, model::Domain& domain) {
  const auto written = table.String("fingerprint");
  if (!written || *written == ModelFingerprint(document)) return;
  domain.as_validated = false;
  table.AddWarning("fingerprint",
                   "does not match: the model was edited after it was fitted. Its radius is no "
                   "longer validated by the measurements and counts as assumed. Undo the edit, or "
                   "measure and diagnose again; delete [domain] to remove this warning");
}

}  // namespace

model::Domain DomainFromToml(const TomlTable& table, const model::Robot& robot,
                             const TomlDocument& document) {
  model::Domain domain;
  // Scaled per joint: the pair of a prismatic joint is in mm.
  if (const auto pairs = table.Matrix("q_deg", {-100000, 100000}, robot.size(), 2)) {
    for (int i = 0; i < robot.size(); ++i) {
      const bool prismatic =
          robot.joints[static_cast<std::size_t>(i)].type == model::JointType::kPrismatic;
      const double to_si = prismatic ? kMetrePerMm : kRadPerDeg;
      domain.q.push_back({(*pairs)(i, 0) * to_si, (*pairs)(i, 1) * to_si});
      if (domain.q.back().low > domain.q.back().high) {
        table.AddFault("q_deg",
                       fmt::format("has the lower end of joint {} above its upper end", i + 1));
      }
    }
  } else if (!table.Has("q_deg")) {
    table.AddMissing("q_deg", "one pair [low, high] per joint");
  }
  domain.combinations = CombinationsFrom(table, robot.size());
  domain.joint_loads = JointLoadsFrom(table, robot.size());
  domain.payload_kg = IntervalFrom(table, "payload_kg", {-10000, 10000});
  domain.tools = table.Integers("tools", 0, kLargestNumber).value_or(std::vector<int>());
  domain.payload_items = table.Integers("payload_items", 0, kLargestNumber);
  if (const auto levels = table.Numbers("payload_levels_kg", {-10000, 10000}, 2)) {
    domain.payload_levels_kg = *levels;
    std::sort(domain.payload_levels_kg.begin(), domain.payload_levels_kg.end());
  }
  domain.temp_C = IntervalFrom(table, "temp_C", kTemperatureRange);
  domain.largest_residual_m = table.Number("largest_residual_mm", kLargestResidual);
  domain.residual_sigma_m = table.Number("residual_sigma_mm", kSigmaRange);
  domain.covariance_share = table.Number("covariance_share", {0, 1}).value_or(1);
  ReadDistance(table, robot, domain);
  if (const auto text = table.String("time_zero_utc")) {
    domain.time_zero_s = text::UtcFromText(*text);
    if (!domain.time_zero_s) {
      table.AddFault("time_zero_utc", "is not a UTC time such as \"2026-11-21T07:30:00Z\"");
    }
  }
  CheckFingerprint(table, document, domain);
  return domain;
}

}  // namespace plumbline::config
