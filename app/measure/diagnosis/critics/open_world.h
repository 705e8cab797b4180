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

/// Rejected rows that one effect explains.
struct RejectedRegime {
  int rows = 0;
  double share = 0;    ///< of their squares that the effect explains
  std::string effect;  ///< its name
  std::string driver;  ///< the column in which they differ most from the other rows
};

/// Tests whether rejected rows are gross errors. Tries each effect of the catalogue without a
/// searched shape, and the effects of the answer, in the rejected rows only and at full weight.
/// Gross errors have independent directions, so that k columns explain a share of their squares
/// that F_{k, n - k} bounds; n is the lengths of the independent events, reduced to (sum s)^2 / sum
/// s^2 events for squares s. A run of rejected rows, or all visits of a pose, may be one event.
/// @return  the effect with the smallest p-value, if that is at most kRegimeSignificance over all
///          effects and choices of joints; nullopt otherwise, and with fewer than four events
std::optional<RejectedRegime> RegimeOfRejectedRows(const Identified& found);

/// Rejected rows that one effect explains are another regime, not gross errors.
Opinion OpinionOnRejectedRows(const Identified& found);

}  // namespace plumbline::measure
