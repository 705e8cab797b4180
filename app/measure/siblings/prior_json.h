// JSON of a fleet's prior and of the steps towards it: the sizes of each arm, the agreed sizes.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/measure/siblings/fleet_prior.h"

namespace plumbline::measure {

// Each text has a `format` and a `schema`. The readers accept what the writers write and refuse
// everything else with a reason. Values are in SI units.

/// What is known of one arm: its own diagnosis and, later, the fit of the agreed sizes.
struct ArmSizes {
  std::string arm;
  std::string rows_sha256;  ///< of the file of rows that the diagnosis and the fit are of
  std::vector<std::string> row_sketch;  ///< of them (repeated_rows.h)
  std::string cell_text;                ///< the declared cell
  std::string found_text;               ///< the same with the findings as [[effect]]
  model::CellModel cell;
  ArmFindings found;
  struct Fitted {
    AgreedSizes asked;
    SizeFit fit;
  };
  std::optional<Fitted> fitted;
};

/// @return  an error if the corrected cell would not be a valid one
Result<ArmSizes> SizesOfArm(const std::string& arm, const std::string& rows_sha256,
                            std::vector<std::string> row_sketch, const std::string& cell_text,
                            const model::CellModel& cell, const Diagnosis& diagnosis,
                            const std::string& date);
std::string JsonFrom(const ArmSizes& sizes);
Result<ArmSizes> ArmSizesFromJson(std::string_view text);

std::string JsonFrom(const AgreedSizes& agreed);
/// @param joints  of the arm
Result<AgreedSizes> AgreedSizesFromJson(std::string_view text, int joints);

std::string JsonFrom(const FleetPrior& prior);
Result<FleetPrior> FleetPriorFromJson(std::string_view text);

/// The arms of this model that are declared like most of them, in the given order; the others, with
/// the reason, in `left_out`.
std::vector<const ArmSizes*> ComparableArms(const std::vector<ArmSizes>& arms,
                                            const std::string& model,
                                            std::vector<LeftOutArm>& left_out);

}  // namespace plumbline::measure
