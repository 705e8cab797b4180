#include "app/plant/sparkplug/cell_message.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"
#include "drivers/plc/register_map.h"

namespace plumbline::plant {
namespace {

using nlohmann::json;

constexpr const char* kNamespacePrefix = "plumblineV1/";
constexpr int kMaxJoints = 32, kMaxCameras = 32;
constexpr std::int64_t kMaxUtc_ms = 253'402'300'800'000;  ///< year 10000

template <typename T>
bool TakeInteger(const json& value, MetricValue& taken) {
  const auto number = text::IntegerFromJsonIfValid<T>(value);
  if (number) taken = static_cast<std::int64_t>(*number);
  return number.has_value();
}

/// The value at `part` of `whole`; nullptr if there is none. What is unknown as a whole is unknown
/// in its parts.
const json* PartOf(const json& whole, const char* part) {
  if (*part == '\0' || whole.is_null()) return &whole;
  if (whole.is_object()) {
    const auto found = whole.find(part);
    return found == whole.end() ? nullptr : &*found;
  }
  std::size_t index = 0;
  std::from_chars(part, part + std::strlen(part), index);
  return whole.is_array() && index < whole.size() ? &whole[index] : nullptr;
}

/// Collects readings; remembers the first fault.
class Decoder {
 public:
  explicit Decoder(const json& message) : message_(message) {}

  const std::string& problem() const { return problem_; }
  std::vector<Reading> TakeReadings() { return std::move(readings_); }

  void Fault(std::string_view key) {
    if (problem_.empty()) problem_ = fmt::format("{}: not a value of its type or range", key);
  }
  void Declare(std::string metric, DataType type, const char* unit) {
    readings_.push_back({std::move(metric), type, unit, {}, Reading::Use::kDeclaration});
  }
  void Add(std::string metric, const json& value, DataType type, const char* unit,
           std::string_view key) {
    MetricValue taken;
    if (!TakeMetricValue(value, type, taken)) return Fault(key);
    readings_.push_back({std::move(metric), type, unit, std::move(taken), Reading::Use::kValue});
  }
  void AddFlag(std::string metric, bool value, Reading::Use use) {
    readings_.push_back({std::move(metric), DataType::kBoolean, "", value, use});
  }
  void SetUnknown(std::string folder) {
    readings_.push_back({std::move(folder), DataType::kDouble, "", {}, Reading::Use::kUnknown});
  }
  void AddFields(const json& object, std::span<const MetricField> fields,
                 const std::string& folder = "") {
    for (const MetricField& field : fields) {
      const auto whole = object.find(field.key);
      if (whole == object.end()) continue;
      const json* const value = PartOf(*whole, field.part);
      if (value == nullptr) {
        Fault(field.key);
      } else {
        Add(folder + field.metric, *value, field.type, field.unit, field.key);
      }
    }
  }
  /// The list at `key`; an empty one, with a fault, if there is none of at most `most` elements.
  const json& ListAt(const char* key, std::size_t most) {
    static const json empty = json::array();
    const auto found = message_.find(key);
    if (found != message_.end() && found->is_array() && found->size() <= most) return *found;
    if (found != message_.end() && !found->is_null()) Fault(key);
    return empty;
  }
  template <typename T>
  T Required(const json& object, const char* key, T least, T most) {
    const auto found = object.is_object() ? object.find(key) : object.end();
    const auto number = found == object.end() || !object.is_object()
                            ? std::nullopt
                            : text::IntegerFromJsonIfValid<T>(*found);
    if (number && *number >= least && *number <= most) return *number;
    Fault(key);
    return least;
  }
  template <typename T>
  T Required(const char* key, T least, T most) {
    return Required<T>(message_, key, least, most);
  }
  std::string RequiredText(const json& object, const char* key) {
    MetricValue text;
    const auto found = object.is_object() ? object.find(key) : object.end();
    if (object.is_object() && found != object.end())
      TakeMetricValue(*found, DataType::kString, text);
    if (const auto* const taken = std::get_if<std::string>(&text); taken != nullptr) return *taken;
    Fault(key);
    return "";
  }
  std::string RequiredText(const char* key) { return RequiredText(message_, key); }

 private:
  const json& message_;
  std::vector<Reading> readings_;
  std::string problem_;
};

int PointId(Decoder& decoder, const json& object, const char* key) {
  return decoder.Required<std::int32_t>(object, key, 0, std::numeric_limits<std::int32_t>::max());
}

/// A birth declares all metrics that the cell will report: Sparkplug's NBIRTH must contain them.
void DecodeBirth(const json& message, Decoder& decoder) {
  decoder.AddFields(message, FieldsOf(CellTopic::kBirth));
  for (const CellTopic topic : {CellTopic::kState, CellTopic::kModel, CellTopic::kProbe}) {
    for (const MetricField& field : FieldsOf(topic))
      decoder.Declare(field.metric, field.type, field.unit);
  }
  for (const AlarmBit& bit : AlarmBits()) decoder.Declare(bit.metric, DataType::kBoolean, "");
  decoder.Declare(AlarmMetric("fleet", "no data from plumblined"), DataType::kBoolean, "");
  const int joints = decoder.Required<std::int32_t>("joints", 0, kMaxJoints);
  for (int k = 0; k < joints; ++k)
    decoder.Declare(JointMetric(static_cast<std::size_t>(k)), DataType::kDouble, "");
  for (const json& point : decoder.ListAt("points", plc::registers::kMaxPoints)) {
    const std::string folder = PointFolder(PointId(decoder, point, "id"));
    for (const MetricField& field : FieldsOf(CellTopic::kPoint))
      decoder.Declare(folder + field.metric, field.type, field.unit);
  }
}

void DecodeState(const json& message, Decoder& decoder) {
  decoder.AddFields(message, FieldsOf(CellTopic::kState));
  if (const auto q = message.find("q"); q != message.end() && q->is_null())
    decoder.SetUnknown("Joints/");
  const json& joints = decoder.ListAt("q", kMaxJoints);
  for (std::size_t k = 0; k < joints.size(); ++k)
    decoder.Add(JointMetric(k), joints[k], DataType::kDouble, "", "q");
  for (const json& camera : decoder.ListAt("cameras", kMaxCameras)) {
    const std::string folder = CameraFolder(decoder.RequiredText(camera, "camera"));
    if (camera.is_object()) decoder.AddFields(camera, CameraFields(), folder);
  }
  for (const AlarmBit& bit : AlarmBits()) {
    const auto word = decoder.Required<std::uint16_t>(bit.word, 0, 65535);
    decoder.AddFlag(bit.metric, (word & bit.mask) != 0, Reading::Use::kResync);
  }
}

void DecodeAlarm(Decoder& decoder) {
  const std::string event = decoder.RequiredText("event");
  if (event != "begin" && event != "end") decoder.Fault("event");
  decoder.AddFlag(AlarmMetric(decoder.RequiredText("word"), decoder.RequiredText("meaning")),
                  event == "begin", Reading::Use::kValue);
}

void DecodeBody(CellTopic topic, const json& message, Decoder& decoder) {
  switch (topic) {
    case CellTopic::kCell:
    case CellTopic::kDeath:
      return;
    case CellTopic::kBirth:
      return DecodeBirth(message, decoder);
    case CellTopic::kState:
      return DecodeState(message, decoder);
    case CellTopic::kAlarm:
      return DecodeAlarm(decoder);
    case CellTopic::kPoint:
      return decoder.AddFields(message, FieldsOf(topic),
                               PointFolder(PointId(decoder, message, "point")));
    case CellTopic::kLens:
      return decoder.AddFields(message, FieldsOf(topic),
                               CameraFolder(decoder.RequiredText("camera")));
    case CellTopic::kProbe:
    case CellTopic::kModel:
    case CellTopic::kLost:
      return decoder.AddFields(message, FieldsOf(topic));
  }
}

}  // namespace

bool TakeMetricValue(const json& value, DataType type, MetricValue& taken) {
  if (value.is_null()) return true;
  switch (type) {
    case DataType::kInt32:
      return TakeInteger<std::int32_t>(value, taken);
    case DataType::kInt64:
      return TakeInteger<std::int64_t>(value, taken);
    case DataType::kUInt16:
      return TakeInteger<std::uint16_t>(value, taken);
    case DataType::kBoolean:
      if (value.is_boolean()) taken = value.get<bool>();
      return value.is_boolean();
    case DataType::kDouble:
      if (!value.is_number() || !std::isfinite(value.get<double>())) return false;
      taken = value.get<double>();
      return true;
    case DataType::kString: {
      const auto* const text = value.get_ptr<const std::string*>();
      if (text == nullptr || text->size() > kMaxMetricText_bytes) return false;
      taken = *text;
      return true;
    }
  }
  return false;
}

std::optional<CellAddress> CellAddressFromTopic(std::string_view topic) {
  if (!topic.starts_with(kNamespacePrefix)) return std::nullopt;
  topic.remove_prefix(std::strlen(kNamespacePrefix));
  const auto type = topic.find('/'), node = topic.rfind('/');
  if (type == std::string_view::npos || node == type || type == 0) return std::nullopt;
  const std::string_view name = topic.substr(node + 1),
                         word = topic.substr(type + 1, node - type - 1);
  const auto known = std::find(std::begin(kCellTopics), std::end(kCellTopics), word);
  if (name.empty() || known == std::end(kCellTopics)) return std::nullopt;
  return CellAddress{std::string(topic.substr(0, type)), std::string(name),
                     static_cast<CellTopic>(known - std::begin(kCellTopics))};
}

Result<CellMessage> CellMessageFromText(CellTopic topic, std::string_view text) {
  if (text.size() > kMaxCellMessage_bytes) return Error{"longer than 1 MB"};
  const Result<json> parsed = text::JsonFromText(text);
  if (!parsed) return parsed.failure();
  if (!parsed->is_object()) return Error{"not a JSON object"};
  Decoder decoder(*parsed);
  CellMessage message;
  message.topic = topic;
  message.utc_ms = decoder.Required<std::int64_t>("timestamp", 0, kMaxUtc_ms);
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  if (topic == CellTopic::kBirth || topic == CellTopic::kDeath) {
    message.bdSeq = decoder.Required<std::int64_t>("bdSeq", 0, kMost);
  } else {
    message.stream = decoder.RequiredText("stream");
    message.seq = decoder.Required<std::int64_t>("seq", 1, kMost);
  }
  DecodeBody(topic, *parsed, decoder);
  if (!decoder.problem().empty()) return Error{decoder.problem()};
  message.readings = decoder.TakeReadings();
  return message;
}

}  // namespace plumbline::plant
