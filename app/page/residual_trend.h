// How far measured points were from where the model put them, one by one, from the journal.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline {

struct TrendPoint {
  std::int64_t id = 0;             ///< of the journal
  std::optional<double> utc_s;     ///< nothing: imported without a date
  Vec3 residual_W = Vec3::Zero();  ///< measured minus predicted [m]
  std::optional<int> model_version;
  bool wild = false, alarm = false;  ///< marks of the drift monitor
};

/// The newest measured points that were predicted, oldest first. Opens the journal for reading, and
/// closes it: the daemon that writes is not kept waiting.
/// @return  none where there is no journal yet; or why it cannot be read
inline constexpr std::int64_t kTrendRows = 400;
Result<std::vector<TrendPoint>> ReadTrend(const std::string& state_directory,
                                          const std::vector<Joint>& joints);

/// {"points": [{"id", "utc_s", "mm", "xyz_mm", "model", "wild", "alarm"}]}, or {"problem"}
std::string TrendJson(const Result<std::vector<TrendPoint>>& trend);

}  // namespace plumbline
