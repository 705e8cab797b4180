// The cell of a command: a cell file, or a daemon's configuration with the model in force.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/correction/correct.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::cli {

struct CellInForce {
  model::CellModel cell;  ///< as points are corrected by it, see deflection::CellOfPoints
  correction::CorrectionLimits limits;
  std::string bytes;  ///< of the file, for its digest
};

/// Reads CELL.toml, or plumbline.toml with the model that its daemon applies. Prints all faults.
/// @return  nullopt if there is a fault
std::optional<CellInForce> ReadCellInForce(const std::string& path);

}  // namespace plumbline::cli
