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
  domain.range_growth_m = table.Number("range_growth_mm", kDistantSigma);
  domain.declared_sigma_m = table.Number("declared_sigma_mm", kDistantSigma);
  domain.applied_share = table.Number("applied_share", {0, 1}).value_or(1);
  for (const auto& [key, other] : {std::pair{"reach_rad", "distant_sigma_mm"},
                                   std::pair{"range_growth_mm", "distant_sigma_mm"},
                                   std::pair{"declared_sigma_mm", "distant_sigma_mm"},
                                   std::pair{"applied_share", "declared_sigma_mm"}}) {
    if (table.Has(key) && !table.Has(other)) {
      table.AddFault(key, fmt::format("requires {}", other));
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

/// The ascending intervals of a flat list [low, high, low, high, ..], with the growth of the error
/// beside them.
std::optional<model::MeasuredRange> RangeFrom(const TomlTable& table, const char* key,
                                              NumberRange range, const char* growth_key,
                                              double growth_to_SI) {
  const std::optional<double> growth = table.Number(growth_key, {0, 1e6, growth_to_SI});
  const auto ends = table.Numbers(key, range);
  if (growth && !table.Has(key)) table.AddFault(growth_key, fmt::format("requires {}", key));
  if (!ends) return std::nullopt;
  if (ends->empty() || ends->size() % 2 != 0 || !std::ranges::is_sorted(*ends)) {
    table.AddFault(key, "is not an ascending list of pairs [low, high, low, high, ..]");
    return std::nullopt;
  }
  model::MeasuredRange measured;
  for (std::size_t k = 0; k < ends->size(); k += 2)
    measured.intervals.push_back({(*ends)[k], (*ends)[k + 1]});
  measured.growth = growth;
  return measured;
}

/// Rows of [joint, lowest, highest torque, growth], or without the growth.
std::vector<model::MeasuredTorque> TorquesFrom(const TomlTable& table, const char* key,
                                               int joints) {
  std::vector<model::MeasuredTorque> torques;
  const auto rows = table.Rows(key, {-1e9, 1e9});
  if (!rows) return torques;
  if (rows->cols() != 3 && rows->cols() != 4) {
    table.AddFault(key, "is not a list of [joint, lowest torque, highest torque, growth]");
    return torques;
  }
  for (Eigen::Index row = 0; row < rows->rows(); ++row) {
    const double number = (*rows)(row, 0), low = (*rows)(row, 1), high = (*rows)(row, 2);
    if (number != std::floor(number) || number < 1 || number > joints) {
      table.AddFault(key, fmt::format("names joint {:g}; the joints are 1 to {}", number, joints));
      continue;
    }
    const auto joint = static_cast<int>(number) - 1;
    if (low > 0 || high < 0)
      table.AddFault(key, fmt::format("has a range of joint {} without 0", joint + 1));
    if (std::ranges::any_of(torques, [&](const auto& other) { return other.joint == joint; }))
      table.AddFault(key, fmt::format("has joint {} twice", joint + 1));
    torques.push_back({joint, model::MeasuredRange{{{low, high}}, {}}});
    model::MeasuredTorque& torque = torques.back();
    if (rows->cols() == 3) continue;
    torque.range.growth = (*rows)(row, 3) * kMetrePerMm;
    if (*torque.range.growth < 0)
      table.AddFault(key, fmt::format("has a negative growth of joint {}", joint + 1));
  }
  return torques;
}

/// What a file of an earlier version states of loads: the levels that were measured, each with 5 %
/// of their range to both sides, and torques without a growth, 2 % beyond which were covered.
void ReadPreviousKeys(const TomlTable& table, const model::Robot& robot, model::Domain& domain) {
  constexpr double kSameLoad = 0.05, kSameTorque = 0.02;
  for (model::MeasuredTorque torque : TorquesFrom(table, "joint_loads_Nm", robot.size())) {
    for (model::Interval& range : torque.range.intervals)
      range = {(1 + kSameTorque) * range.low, (1 + kSameTorque) * range.high};
    domain.torques.push_back(std::move(torque));
  }
  if (auto levels = table.Numbers("payload_levels_kg", {-10000, 10000}, 2); levels) {
    std::ranges::sort(*levels);
    const double same_kg = kSameLoad * (levels->back() - levels->front());
    domain.payload_kg = model::MeasuredRange{};
    for (const double level : *levels)
      domain.payload_kg->intervals.push_back({level - same_kg, level + same_kg});
  }
  // Combinations of joints: the distance of the postures says as much.
  const bool previous = table.Rows("joint_combinations", {-100000, 100000}).has_value() ||
                        table.Has("joint_loads_Nm") || table.Has("payload_levels_kg");
  if (!previous) return;
  table.AddWarning("",
                   "is from an earlier version; the next one will not read it: "
                   "diagnose the rows again");
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
  domain.torques = TorquesFrom(table, "torques_Nm", robot.size());
  domain.payload_kg =
      RangeFrom(table, "payload_kg", {-10000, 10000}, "payload_growth_mm_per_kg", kMetrePerMm);
  domain.temp_C =
      RangeFrom(table, "temp_C", kTemperatureRange, "temp_growth_mm_per_K", kMetrePerMm);
  domain.t_s = RangeFrom(table, "t_s", {-1e12, 1e12}, "time_growth_mm_per_h", kMetrePerMm / 3600);
  ReadPreviousKeys(table, robot, domain);
  domain.tools = table.Integers("tools", 0, kLargestNumber).value_or(std::vector<int>());
  domain.payload_items = table.Integers("payload_items", 0, kLargestNumber);
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
