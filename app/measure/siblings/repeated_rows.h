// Rows that two sets of measurements have in common.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "app/measure/table/csv.h"

namespace plumbline::measure {

/// Number of rows of `b` that are also rows of `a`: equal artefact, and joints and readings that
/// differ by no more than the rounding of the set with fewer written decimals, and at least 1e-6
/// rad and 1e-6 m. Angles of revolute joints may differ by whole turns. Readings rounded more
/// coarsely than to 0.05 mm count as rounded to 0.05 mm, since those of two arms agree in coarser
/// digits by chance. Each row of `a` counts once. Time, temperature, payload and order may differ,
/// since they are easily edited.
/// @param joints  of the robot; both sets have as many
std::size_t RepeatedRows(const MeasuredTable& a, const MeasuredTable& b,
                         const std::vector<model::Joint>& joints);

/// True if so many rows cannot be equal by chance: more than a tenth of the smaller set, and at
/// least three. Two arms moved to the same commanded joints differ by more than the resolution of a
/// measured position in practically every row; the reading of a coarse gauge (0.01 mm, arms that
/// differ by 0.1 mm) agrees by chance in three of a hundred.
bool IsRepeated(std::size_t repeated, std::size_t rows_a, std::size_t rows_b);

// Recognising an arm's rows without having them.

/// A digest of each row's artefact, joints (0.001 deg, modulo 360) and readings (0.001 mm): 16
/// hexadecimal digits, sorted, none twice. Rows without a reading have none.
std::vector<std::string> RowDigests(const MeasuredTable& set,
                                    const std::vector<model::Joint>& joints);

/// The first kSketchRows of RowDigests(): a sample of the rows that does not depend on which other
/// rows a set has, so that equal rows of two sets are drawn into both samples.
std::vector<std::string> RowSketch(const MeasuredTable& set,
                                   const std::vector<model::Joint>& joints);
inline constexpr std::size_t kSketchRows = 64;

/// True if the set with these digests has at least a tenth of the rows that the sketch is of. Fewer
/// rows are hardly noticed. Rows rounded otherwise than the sketched ones have other digests.
/// @param digests  sorted
bool IsSketchOf(const std::vector<std::string>& sketch, const std::vector<std::string>& digests);

}  // namespace plumbline::measure
