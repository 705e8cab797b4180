// File of the cells' points, kept across restarts: the cells report only changes of them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/plant/sparkplug/metric_store.h"
#include "firmware-like/result.h"

namespace plumbline::plant {

using CellName = std::pair<std::string, std::string>;  ///< group, node
using KeptPoints = std::map<CellName, MetricStore::Kept>;

/// Of all cells together; further values are not kept.
inline constexpr std::size_t kMaxKept = 100'000;

std::string TextOfKeptPoints(const KeptPoints& points);
/// An error if it is not such a text; values of another type are left out.
Result<KeptPoints> KeptPointsFromText(std::string_view text);

}  // namespace plumbline::plant
