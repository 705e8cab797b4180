// Word, glyph and style of a cell's state, the same on every surface of the plant.
#pragma once

#include "app/plant/answers/plant_status.h"

namespace plumbline::plant {

struct StateWord {
  const char* name;   ///< class of the style sheet, and value in JSON
  const char* glyph;  ///< as on the cell's own page
  const char* word;   ///< "OK", "NOTE", "ATTENTION", "ALARM", "NO DATA"
};
StateWord WordOf(const RankedCell& cell);

/// At most `columns` characters of UTF-8, padded to them; a longer text ends in an ellipsis.
std::string Padded(std::string_view text, std::size_t columns);

}  // namespace plumbline::plant
