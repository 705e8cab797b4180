// What nobody listed: rivals of every name that need no catalogue, and rejected rows as data.
#pragma once

#include <optional>
#include <string>

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/identify.h"

namespace plumbline::measure {

/// Lets every named effect compete with what is not in the catalogue:
///  - a smooth curve of the signal that its law follows (time, temperature, load, the angle of a
///    periodic error) in its place. It is a rival unless it is worse by kRivalGap;
///  - an effect of the catalogue, or the named one, in one session, with one tool, payload item or
///    payload alone, in its place or beside it. An effect that acts everywhere is likelier, so this
///    is a rival only if it scores better. If it is better by kUnknownMargin, the column that
///    distinguishes these rows is added to `diagnosis.drivers`: the answer is then unknown.
/// Linear fits; not a rival is what moves the rows as the named effect does.
/// @param found  `unknown` is false; its candidate set is extended
void AddOpenRivals(Identified& found, Diagnosis& diagnosis);

/// Rejected rows that one effect explains.
struct RejectedRegime {
  int rows = 0;
  std::string effect;  ///< its name: what would explain them
  std::string driver;  ///< the recorded column in which they differ most from the other rows
};

/// Rejected rows are gross errors only if no effect fits them. Tries each effect of the catalogue
/// without a searched shape, and the effects of the answer, in the rejected rows alone and at full
/// weight. Gross errors have independent directions: k columns explain a share of their squares
/// that F_{k, n - k} bounds, n the rows' lengths, reduced to (sum s)^2 / sum s^2 rows of squares s.
/// @return  the effect with the smallest p-value, if that is at most 0.001 over all effects tried;
///          nullopt otherwise, and with fewer than four rejected poses
std::optional<RejectedRegime> RegimeOfRejectedRows(const Identified& found);

}  // namespace plumbline::measure
