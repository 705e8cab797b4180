// Message of a cell, decoded from topic and JSON into readings of metrics.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "app/plant/sparkplug/metric_table.h"
#include "firmware-like/result.h"

namespace plumbline::plant {

/// Value of a metric; std::monostate: unknown.
using MetricValue = std::variant<std::monostate, std::int64_t, double, bool, std::string>;

struct Reading {
  enum class Use {
    kValue,        ///< the metric's value
    kDeclaration,  ///< the metric exists; its value stays
    kResync,       ///< the metric's value, if changes of it may have been missed
    kUnknown,      ///< all metrics below this folder are unknown
  };
  std::string metric;
  DataType type = DataType::kDouble;
  const char* unit = "";
  MetricValue value;
  Use use = Use::kValue;
};

struct CellMessage {
  CellTopic topic = CellTopic::kState;
  std::int64_t utc_ms = 0;
  std::string stream;    ///< of a numbered message
  std::int64_t seq = 0;  ///< from 1; 0: not numbered, which are NBIRTH and NDEATH
  std::int64_t bdSeq = 0;
  std::vector<Reading> readings;
};

/// The levels of plumblineV1/GROUP/TYPE/NODE.
struct CellAddress {
  std::string group, node;
  CellTopic topic = CellTopic::kState;
};
/// nullopt for any other topic.
std::optional<CellAddress> CellAddressFromTopic(std::string_view topic);

/// Reads a JSON value of a type; null is the unknown value.
/// @return  false if it is of another type or outside the type's range
bool TakeMetricValue(const nlohmann::json& json, DataType type, MetricValue& taken);

inline constexpr std::size_t kMaxCellMessage_bytes = 1'000'000;
inline constexpr std::size_t kMaxMetricText_bytes = 1024;

/// Reads the fields that the table names and ignores others, so that newer cells are understood. A
/// field of another type, outside its range, or longer than kMaxMetricText_bytes is an error of the
/// whole message.
Result<CellMessage> CellMessageFromText(CellTopic topic, std::string_view text);

}  // namespace plumbline::plant
