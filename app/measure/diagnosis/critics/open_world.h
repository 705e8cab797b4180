// Rivals of every name that need no catalogue entry, and rejected rows as data.
#pragma once

#include <optional>
#include <string>

#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/diagnosis/search/identify.h"

namespace plumbline::measure {

/// Lets every named effect compete with causes that are not in the catalogue:
///  - a smooth curve of the signal that its law follows (time, temperature, load, the angle of a
///    periodic error) in its place, or in place of all names that follow it. It is a rival unless
///    it is worse by kRivalGap;
///  - an effect of the catalogue in one session, or with one tool, payload item or payload only, in
///    its place. An effect that acts everywhere is likelier, so this is a rival only if it scores
///    better. If that effect, in place of a name or beside all, is better by kUnknownMargin, the
///    column that distinguishes these rows is a driver, with a note.
/// The fits are linear. An effect that moves the measured rows exactly as the named one does is not
/// a rival, nor is a curve that changes where no row was measured in place of an event there. A
/// driver makes the answer `unknown`. No opinion on an answer with an empirical curve.
Opinion OpinionOnOpenWorld(const Identified& found);

/// Rejected rows that are hardly gross errors.
struct RejectedRegime {
  int rows = 0;
  double share = 0;    ///< of their squares that the effect explains
  std::string effect;  ///< the one that explains most; its name
  double p_value = 1;  ///< of that share by chance, over all effects
  std::string driver;  ///< the column in which they differ most from the others; may be empty
};

/// Tests whether rejected rows are gross errors, which have independent directions and are in any
/// rows. A run of rejected rows, or all visits of a pose, may be one event.
///  - Each effect of the catalogue without a searched shape, and the answer's own effects, are
///    tried in the rejected rows only and at full weight: k columns explain a share of the squares
///    that F_{k, n - k} bounds; n is the lengths of the independent events, reduced to
///    (sum s)^2 / sum s^2 events for squares s.
///  - The events are compared with the other rows in every column.
/// Both p-values, each over all that was tried, are independent for gross errors and are combined
/// [R. A. Fisher, Statistical Methods for Research Workers (1932), sec. 21.1]:
///   p = p_1 p_2 (1 - ln(p_1 p_2))
/// @return  nullopt if p exceeds kRegimeSignificance, and with fewer than four events
std::optional<RejectedRegime> RegimeOfRejectedRows(const Identified& found);

/// Such rows are another regime.
Opinion OpinionOnRejectedRows(const Identified& found);

}  // namespace plumbline::measure
