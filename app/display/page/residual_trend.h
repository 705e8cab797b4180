// Residual trend: residuals of the newest probes, read from the journal.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::display {

struct TrendPoint {
  std::int64_t id = 0;             ///< row of the journal
  std::optional<double> utc_s;     ///< nullopt if imported without a date
  Vec3 residual_W = Vec3::Zero();  ///< measured minus predicted [m]
  std::optional<int> model_version;
  std::optional<double> payload_kg;
  bool wild = false, alarm = false;  ///< set by the drift monitor
};

/// Reads the newest probes that have a prediction, oldest first. Opens the journal read-only and
/// closes it again, so that the daemon's writes are not blocked.
/// @return  empty if there is no journal yet; or why it cannot be read
inline constexpr std::int64_t kTrendRows = 400;
Result<std::vector<TrendPoint>> ReadTrend(const std::string& state_directory,
                                          const std::vector<model::Joint>& joints);

/// {"points": [{"id", "utc_s", "mm", "xyz_mm", "model", "payload_kg", "wild", "alarm"}]}, or
/// {"problem"}
std::string TrendJson(const Result<std::vector<TrendPoint>>& trend);

}  // namespace plumbline::display
