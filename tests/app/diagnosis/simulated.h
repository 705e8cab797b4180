// Fresh data of the simulator for tests, and rows made by the product's own model.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "app/diagnosis/linearisation.h"

namespace plumbline {

struct MeasuredCell {
  CellModel cell;
  MeasuredTable table;
};

/// cell.toml and measured.csv of a folder; a test fails where they cannot be read.
MeasuredCell ReadMeasuredCell(const std::string& folder);

/// What plumbline-simulate writes with these options.
MeasuredCell Simulated(const std::string& options);

/// Measured points overwritten: the cell's own prediction with these effects, and normal noise of
/// sigma on each axis.
void Remeasure(MeasuredCell& data, const std::vector<ActiveEffect>& effects, double sigma_m,
               unsigned seed);

/// What effects move the tip by at each row, to first order [m].
std::vector<Vec3> DisplacementBy(const MeasuredCell& data,
                                 const std::vector<ActiveEffect>& effects);

/// An effect of the catalogue: parameter names and values in SI.
ActiveEffect EffectWith(const CellModel& cell, const std::string& id,
                        const std::vector<std::pair<std::string, double>>& values,
                        const std::string& word = "");

}  // namespace plumbline
