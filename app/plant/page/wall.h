// Wall of the plant's page: one card a cell as HTML, in order of urgency, with what changed when.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "app/plant/answers/plant_status.h"

namespace plumbline::plant {

struct WallCard {
  std::int64_t cell = 0;
  std::string line;           ///< not escaped
  std::string words;          ///< in lower case, for the search: line, name, node, arm, reasons
  std::string state;          ///< name of its StateWord
  std::string group;          ///< list on the page: "person", "note" or "rest"
  std::string html;           ///< an <li>, everything from the cell escaped
  std::uint64_t changed = 0;  ///< version of the wall at which `html` was last changed
};

/// State strip of the page, as on a cell's page.
struct WallStrip {
  std::string style, glyph, headline, reason;
  bool operator==(const WallStrip&) const = default;
};

/// Immutable once made.
struct Wall {
  std::uint64_t version = 0;
  double now_utc = 0;
  WallStrip strip;
  std::vector<WallCard> cards;  ///< most urgent first
  std::string status;           ///< StatusJson() of the cells
};

/// The wall of the cells' newest states. Its version is that of `before` if nothing visible
/// changed.
Wall WallFrom(const std::vector<CellState>& cells, double now_utc, const Wall& before);

/// What a viewer of the wall may select.
struct WallSelection {
  std::string words;  ///< all of them must occur; in lower case
  std::string state;  ///< "", "person", or the name of a state
  bool by_line = false;
  bool Shows(const WallCard& card) const;
};

/// The whole page, complete without scripts.
/// @param start    identifies this run of the program
/// @param problem  why the wall may be old; empty if it is not
std::string WallHtml(const Wall& wall, const WallSelection& selection, const std::string& start,
                     const std::string& problem);

/// Changes after version `since` for the script of the page: strip, order of the cells, and the
/// cards that changed.
std::string WallUpdateJson(const Wall& wall, std::uint64_t since, const std::string& start,
                           const std::string& problem);

/// "START-VERSION" as WallUpdateJson() writes it. @return  the version; 0 for any other text or
/// another start, so that everything is sent again
std::uint64_t VersionFromText(std::string_view text, const std::string& start);

}  // namespace plumbline::plant
