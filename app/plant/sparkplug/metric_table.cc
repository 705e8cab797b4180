#include "app/plant/sparkplug/metric_table.h"

#include <fmt/format.h>

#include "drivers/plc/register_map.h"

namespace plumbline::plant {
namespace {

constexpr DataType kInt = DataType::kInt32, kLong = DataType::kInt64, kWord = DataType::kUInt16,
                   kReal = DataType::kDouble, kFlag = DataType::kBoolean, kText = DataType::kString;

constexpr MetricField kBirthFields[] = {
    {"version", "", "Publisher/Version", kText},
    {"schema", "", "Publisher/Schema", kInt},
    {"stream", "", "Publisher/Stream", kText},
    {"waiting", "", "Publisher/Queued", kLong},
    {"dropped", "states", "Publisher/Dropped/States", kLong},
    {"dropped", "changes", "Publisher/Dropped/Changes", kLong},
    {"dropped", "others", "Publisher/Dropped/Others", kLong},
    {"cell", "", "Cell/Arm", kText},
    {"joints", "", "Cell/Joints", kInt},
};
constexpr MetricField kLostFields[] = {
    {"states", "", "Publisher/Dropped/States", kLong},
    {"changes", "", "Publisher/Dropped/Changes", kLong},
    {"others", "", "Publisher/Dropped/Others", kLong},
};
constexpr MetricField kStateFields[] = {
    {"status", "", "Status/Word", kWord},
    {"alarms", "", "Status/Alarms", kWord},
    {"warnings", "", "Status/Warnings", kWord},
    {"data_age_ms", "", "Status/Data age", kReal, "ms"},
    {"health", "", "Health/Severity", kInt},
    {"health_reason", "", "Health/Reason", kText},
    {"model", "", "Model/In force", kInt},
    {"proposed_model", "", "Model/Proposed", kInt},
    {"payload_kg", "", "Payload/Mass", kReal, "kg"},
    {"temp_C", "", "Cell/Temperature", kReal, "degC"},
    {"points", "", "Points/Count", kInt},
    {"points_valid", "", "Points/Valid count", kInt},
    {"monitoring", "", "Monitoring/Word", kWord},
    {"probes", "", "Monitoring/Probes", kLong},
    {"drift_statistic", "", "Monitoring/Drift statistic", kReal},
};
constexpr MetricField kModelFields[] = {
    {"model", "", "Model/In force", kInt},
    {"before", "", "Model/Before", kInt},
    {"declared", "", "Model/Declared", kInt},
    {"proposed", "", "Model/Proposed", kInt},
};
constexpr MetricField kPointFields[] = {
    {"name", "", "Name", kText},
    {"valid", "", "Valid", kFlag},
    {"extrapolated", "", "Extrapolated", kFlag},
    {"code", "", "Code", kInt},
    {"reason", "", "Reason", kText},
    {"correction_mm", "0", "Correction/X", kReal, "mm"},
    {"correction_mm", "1", "Correction/Y", kReal, "mm"},
    {"correction_mm", "2", "Correction/Z", kReal, "mm"},
    {"correction_size_mm", "", "Correction/Size", kReal, "mm"},
    {"command_mm", "0", "Command/X", kReal, "mm"},
    {"command_mm", "1", "Command/Y", kReal, "mm"},
    {"command_mm", "2", "Command/Z", kReal, "mm"},
    {"uncertainty_mm", "", "Uncertainty/Radius", kReal, "mm"},
    {"basis", "", "Uncertainty/Basis", kText},
    {"model", "", "Model", kInt},
};
constexpr MetricField kProbeFields[] = {
    {"journal", "", "Probe/Journal", kLong},
    {"id", "", "Probe/Id", kLong},
    {"source", "", "Probe/Source", kText},
    {"session", "", "Probe/Session", kText},
    {"model", "", "Probe/Model", kInt},
    {"measured_mm", "0", "Probe/Measured/X", kReal, "mm"},
    {"measured_mm", "1", "Probe/Measured/Y", kReal, "mm"},
    {"measured_mm", "2", "Probe/Measured/Z", kReal, "mm"},
    {"predicted_mm", "0", "Probe/Predicted/X", kReal, "mm"},
    {"predicted_mm", "1", "Probe/Predicted/Y", kReal, "mm"},
    {"predicted_mm", "2", "Probe/Predicted/Z", kReal, "mm"},
    {"residual_mm", "0", "Probe/Residual/X", kReal, "mm"},
    {"residual_mm", "1", "Probe/Residual/Y", kReal, "mm"},
    {"residual_mm", "2", "Probe/Residual/Z", kReal, "mm"},
    {"residual_size_mm", "", "Probe/Residual/Size", kReal, "mm"},
    {"payload_kg", "", "Probe/Payload", kReal, "kg"},
    {"temp_C", "", "Probe/Temperature", kReal, "degC"},
    {"wild", "", "Probe/Wild", kFlag},
    {"alarm", "", "Probe/Alarm", kFlag},
    {"quarantined", "", "Probe/Quarantined", kFlag},
};
constexpr MetricField kLensFields[] = {
    {"lens", "", "Lens", kText},
    {"reason", "", "Reason", kText},
    {"lens_id", "", "Lens id", kLong},
    {"zoom_counts", "", "Zoom", kInt, "counts"},
    {"board_views", "", "Board views", kInt},
};
constexpr std::size_t kCameraFieldsOfState = 3;  ///< the first of kLensFields

/// Letters, digits, spaces, '-' and '_'; Sparkplug discourages the rest in names.
std::string PlainName(std::string_view text) {
  std::string name;
  for (const char c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (letter || c == ' ' || c == '-' || c == '_' || static_cast<unsigned char>(c) >= 128)
      name += c;
  }
  while (!name.empty() && name.back() == ' ') name.pop_back();
  return name.empty() ? "unnamed" : name;
}

}  // namespace

std::span<const MetricField> FieldsOf(CellTopic topic) {
  switch (topic) {
    case CellTopic::kBirth:
      return kBirthFields;
    case CellTopic::kState:
      return kStateFields;
    case CellTopic::kPoint:
      return kPointFields;
    case CellTopic::kProbe:
      return kProbeFields;
    case CellTopic::kLens:
      return kLensFields;
    case CellTopic::kModel:
      return kModelFields;
    case CellTopic::kLost:
      return kLostFields;
    case CellTopic::kCell:  // a description that Sparkplug has no use for; counted all the same
    case CellTopic::kDeath:
    case CellTopic::kAlarm:
      return {};
  }
  return {};
}

std::span<const MetricField> CameraFields() {
  return std::span(kLensFields).first(kCameraFieldsOfState);
}

std::string PointFolder(int id) {
  return fmt::format("Points/{}/", id);
}

std::string CameraFolder(std::string_view name) {
  return fmt::format("Cameras/{}/", PlainName(name));
}

std::string JointMetric(std::size_t index) {
  return fmt::format("Joints/{}", index + 1);
}

std::string AlarmMetric(std::string_view word, std::string_view meaning) {
  return fmt::format("Alarms/{}/{}", PlainName(word),
                     PlainName(meaning.substr(0, meaning.find_first_of(":("))));
}

const std::vector<AlarmBit>& AlarmBits() {
  static const std::vector<AlarmBit> bits = [] {
    std::vector<AlarmBit> all;
    for (const plc::BitMeaning& bit : plc::registers::AlarmBits())
      all.push_back({"alarms", bit.mask, AlarmMetric("alarms", bit.meaning)});
    for (const plc::BitMeaning& bit : plc::registers::WarningBits())
      all.push_back({"warnings", bit.mask, AlarmMetric("warnings", bit.meaning)});
    return all;
  }();
  return bits;
}

}  // namespace plumbline::plant
