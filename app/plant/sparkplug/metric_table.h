// Table of the Sparkplug metrics: which field of which message of a cell is which metric.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::plant {

/// Data types of Sparkplug, with the numbers of its specification. UInt32 is not among them: its
/// specification says int_value, the reference implementation and many hosts read long_value
/// (issue 397 of eclipse-tahu/tahu).
enum class DataType : std::uint32_t {
  kInt32 = 3,
  kInt64 = 4,
  kUInt16 = 6,
  kDouble = 10,
  kBoolean = 11,
  kString = 12,
};

/// What a cell publishes, by the third level of its topic.
enum class CellTopic {
  kBirth,
  kDeath,
  kState,
  kPoint,
  kProbe,
  kLens,
  kModel,
  kAlarm,
  kLost,
  kCell
};
inline constexpr const char* kCellTopics[] = {"NBIRTH", "NDEATH", "NDATA",  "NPOINT", "NPROBE",
                                              "NLENS",  "NMODEL", "NALARM", "NLOST",  "NCELL"};

/// A metric and the place of its value in the JSON of a message.
struct MetricField {
  const char* key;
  const char* part;  ///< member of the object, or index in the list, that is at `key`; "": itself
  const char* metric;
  DataType type = DataType::kDouble;
  const char* unit = "";  ///< property engUnit
};

/// Fields of a message. Those of a point are below PointFolder(), those of a lens below
/// CameraFolder().
std::span<const MetricField> FieldsOf(CellTopic topic);
/// Fields of one element of `cameras` in a state.
std::span<const MetricField> CameraFields();
std::string PointFolder(int id);
std::string CameraFolder(std::string_view name);
std::string JointMetric(std::size_t index);
/// @param word  "alarms", "warnings" or "fleet". Of `meaning` only what precedes an explanation is
///              used, and no characters that Sparkplug discourages.
std::string AlarmMetric(std::string_view word, std::string_view meaning);

/// A bit of the words `alarms` and `warnings`, and its metric.
struct AlarmBit {
  const char* word;
  std::uint16_t mask;
  std::string metric;
};
const std::vector<AlarmBit>& AlarmBits();

}  // namespace plumbline::plant
