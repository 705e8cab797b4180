// Name of a cell, and word, glyph and style of its state, the same on every surface of the plant.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/plant/answers/plant_status.h"

namespace plumbline::plant {

struct StateWord {
  const char* name;   ///< class of the style sheet, and value in JSON
  const char* glyph;  ///< as on the cell's own page
  const char* word;   ///< "OK", "NOTE", "ATTENTION", "ALARM", "NO DATA"
};
StateWord WordOf(const RankedCell& cell);

/// How many of the cells have each word, most urgent first: "1 ALARM", "3 OK".
std::vector<std::string> CountsByWord(const std::vector<RankedCell>& cells);

/// "cell-7", which the broker vouches for; "cell-7 (Press 3)" if the cell calls itself something
/// else than its node, apart from case, spaces and dashes.
std::string ShownName(const std::string& node, const std::string& name);

/// Of ASCII letters; others stay as they are.
std::string LowerCase(std::string_view text);

/// At most `columns` characters of UTF-8, padded to them; a longer text ends in an ellipsis.
std::string Padded(std::string_view text, std::size_t columns);

}  // namespace plumbline::plant
