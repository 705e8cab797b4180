#include "firmware-like/payload_selection.h"

#include <utility>

#include "firmware-like/loads/numbered_load.h"

namespace plumbline {
namespace {

/// Payload of that mass and centre of gravity; nullopt if either is unknown or implausible.
std::optional<loads::Payload> KnownPayload(std::optional<double> mass_kg,
                                           const std::optional<Vec3>& cog_F) {
  const bool plausible = mass_kg && *mass_kg >= 0 && *mass_kg <= loads::kMaxPayload_kg;
  if (!plausible || (*mass_kg > 0 && !cog_F)) return std::nullopt;
  return loads::Payload{*mass_kg, cog_F.value_or(Vec3::Zero())};
}

}  // namespace

PayloadSelector::PayloadSelector(PayloadPolicy policy, const std::optional<Vec3>& declared_cog_F)
    : policy_(std::move(policy)), declared_cog_F_(declared_cog_F) {}

void PayloadSelector::Select(const model::RobotState* robot, const model::CellModel& cell) {
  tool_number_ = robot != nullptr ? robot->tool_number : std::nullopt;
  item_number_ = robot != nullptr ? robot->payload_item : std::nullopt;
  std::optional<double> mass_kg;
  std::optional<Vec3> cog_F = declared_cog_F_;
  const auto take = [&](const PayloadPolicy::ToolLoad& load) {
    mass_kg = load.mass_kg;
    if (load.cog_F) cog_F = load.cog_F;
  };
  switch (policy_.source) {
    case PayloadPolicy::Source::kFixed:
      take(policy_.fixed);
      break;
    case PayloadPolicy::Source::kTable:
      for (const PayloadPolicy::ToolLoad& load : policy_.table) {
        if (robot != nullptr && robot->tool_number == load.number) take(load);
      }
      break;
    case PayloadPolicy::Source::kRobot:
      if (robot == nullptr) break;
      mass_kg = robot->payload_kg;
      if (robot->payload_cog_F) cog_F = robot->payload_cog_F;
      break;
  }
  undeclared_ = robot != nullptr ? UndeclaredBy(cell) : UndeclaredNumber{};
  cog_F_ = cog_F && cog_F->allFinite() ? cog_F : std::nullopt;
  present_ = WithToolAndItem(KnownPayload(mass_kg, cog_F_), cell);
}

std::optional<loads::Payload> PayloadSelector::WithMass(const std::optional<double>& own_mass_kg,
                                                        const model::CellModel& cell) const {
  if (!own_mass_kg) return present_;
  return WithToolAndItem(KnownPayload(own_mass_kg, declared_cog_F_ ? declared_cog_F_ : cog_F_),
                         cell);
}

UndeclaredNumber PayloadSelector::UndeclaredBy(const model::CellModel& cell) const {
  using Kind = UndeclaredNumber::Kind;
  const bool numbered = cell.tools() > 1 || cell.tool.number;
  if (numbered && !loads::ToolIndexOf(cell, tool_number_)) return {Kind::kTool, tool_number_};
  const bool known = item_number_ && (*item_number_ == 0 || loads::ItemOf(cell, item_number_));
  if (!cell.payload_items.empty() && !known) return {Kind::kItem, item_number_};
  return {};
}

std::optional<loads::Payload> PayloadSelector::WithToolAndItem(
    std::optional<loads::Payload> payload, const model::CellModel& cell) const {
  if (!payload) return payload;
  if (cell.tools() > 1 || cell.tool.number) {
    const std::optional<int> tool = loads::ToolIndexOf(cell, tool_number_);
    if (!tool) return std::nullopt;
    payload->tool = *tool;
  }
  if (cell.payload_items.empty()) return payload;
  if (!item_number_) return std::nullopt;
  const model::PayloadItem* item = loads::ItemOf(cell, item_number_);
  if (item == nullptr && *item_number_ != 0) return std::nullopt;
  const loads::Payload both = loads::WithItem(*payload, item);
  return both.mass_kg <= loads::kMaxPayload_kg ? std::optional(both) : std::nullopt;
}

}  // namespace plumbline
