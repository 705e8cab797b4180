// Texts on the tool and the payload item that the controller or a row names by number.
#pragma once

#include <string>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/payload_selection.h"

namespace plumbline::config {

/// "0, 4": the numbers of the declared tools, and of the declared payload items ("none").
std::string ToolNumbersText(const model::CellModel& cell);
std::string ItemNumbersText(const model::CellModel& cell);

/// Problem of a reported number, and its remedy.
struct NumberAdvice {
  std::string problem;  ///< empty if there is none
  std::string remedy;
  bool operator==(const NumberAdvice&) const = default;
};

/// Names the undeclared number and the declared ones. Empty for kNone.
NumberAdvice AdviceOn(const UndeclaredNumber& undeclared, const model::CellModel& cell);

/// Names a tool, or a payload item, that the model was not fitted to, and those that it was:
/// "payload item 3 was not measured (measured: 0, 1)". Empty if it lies in the domain.
/// @param tool  index, see CellModel::ToolAt
/// @param item  number, or 0 for none
std::string UnmeasuredToolText(const model::CellModel& cell, int tool);
std::string UnmeasuredItemText(const model::CellModel& cell, int item);
/// Both, separated by a semicolon; empty if both lie in the domain.
std::string UnmeasuredText(const model::CellModel& cell, int tool, int item);

}  // namespace plumbline::config
