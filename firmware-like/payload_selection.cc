#include "firmware-like/payload_selection.h"

#include <utility>

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

void PayloadSelector::Select(const model::RobotState* robot) {
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
  cog_F_ = cog_F && cog_F->allFinite() ? cog_F : std::nullopt;
  present_ = KnownPayload(mass_kg, cog_F_);
}

std::optional<loads::Payload> PayloadSelector::WithMass(
    const std::optional<double>& own_mass_kg) const {
  if (!own_mass_kg) return present_;
  return KnownPayload(own_mass_kg, declared_cog_F_ ? declared_cog_F_ : cog_F_);
}

}  // namespace plumbline
