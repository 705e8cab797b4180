#include "app/plant/sparkplug/payload.h"

#include <sparkplug_payload.pb.h>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"

namespace plumbline::plant {
namespace {

constexpr const char* kRebirth = "Node Control/Rebirth";
constexpr std::size_t kMaxIgnored = 8, kMaxNameInLog = 80;

void PutValue(const Metric& metric, sparkplug_b::Metric& out) {
  if (std::holds_alternative<std::monostate>(metric.value)) {
    out.set_is_null(true);
  } else if (const auto* const integer = std::get_if<std::int64_t>(&metric.value)) {
    // Negative numbers of 32 bits are stored as their two's complement.
    if (metric.type == DataType::kInt64) {
      out.set_long_value(static_cast<std::uint64_t>(*integer));
    } else {
      out.set_int_value(static_cast<std::uint32_t>(*integer));
    }
  } else if (const auto* const real = std::get_if<double>(&metric.value)) {
    out.set_double_value(*real);
  } else if (const auto* const flag = std::get_if<bool>(&metric.value)) {
    out.set_boolean_value(*flag);
  } else {
    out.set_string_value(std::get<std::string>(metric.value));
  }
}

void PutQuality(Quality quality, sparkplug_b::Metric& out) {
  out.mutable_properties()->add_keys("Quality");
  sparkplug_b::PropertyValue& value = *out.mutable_properties()->add_values();
  value.set_type(static_cast<std::uint32_t>(DataType::kInt32));
  value.set_int_value(static_cast<std::uint32_t>(quality));
}

void PutUnit(const char* unit, sparkplug_b::Metric& out) {
  out.mutable_properties()->add_keys("engUnit");
  sparkplug_b::PropertyValue& value = *out.mutable_properties()->add_values();
  value.set_type(static_cast<std::uint32_t>(DataType::kString));
  value.set_string_value(unit);
}

void PutSequence(int bdSeq, std::int64_t now_ms, sparkplug_b::Payload& payload) {
  payload.set_timestamp(static_cast<std::uint64_t>(now_ms));
  sparkplug_b::Metric& metric = *payload.add_metrics();
  metric.set_name("bdSeq");
  metric.set_timestamp(static_cast<std::uint64_t>(now_ms));
  metric.set_datatype(static_cast<std::uint32_t>(DataType::kInt64));
  metric.set_long_value(static_cast<std::uint64_t>(bdSeq));
}

}  // namespace

std::string NodeBirth(const MetricStore& store, int bdSeq, int seq, std::int64_t now_ms) {
  sparkplug_b::Payload payload;
  PutSequence(bdSeq, now_ms, payload);
  payload.set_seq(static_cast<std::uint64_t>(seq));
  sparkplug_b::Metric& rebirth = *payload.add_metrics();
  rebirth.set_name(kRebirth);
  rebirth.set_timestamp(static_cast<std::uint64_t>(now_ms));
  rebirth.set_datatype(static_cast<std::uint32_t>(DataType::kBoolean));
  rebirth.set_boolean_value(false);
  std::uint64_t alias = 0;
  for (const Metric& metric : store.All()) {
    sparkplug_b::Metric& out = *payload.add_metrics();
    out.set_name(metric.name);
    out.set_alias(++alias);
    out.set_timestamp(static_cast<std::uint64_t>(metric.utc_ms > 0 ? metric.utc_ms : now_ms));
    out.set_datatype(static_cast<std::uint32_t>(metric.type));
    PutValue(metric, out);
    if (*metric.unit != '\0') PutUnit(metric.unit, out);
    if (metric.quality != Quality::kGood) PutQuality(metric.quality, out);
  }
  return payload.SerializeAsString();
}

std::string NodeData(MetricStore& store, int seq, std::int64_t now_ms) {
  sparkplug_b::Payload payload;
  payload.set_timestamp(static_cast<std::uint64_t>(now_ms));
  payload.set_seq(static_cast<std::uint64_t>(seq));
  for (const MetricStore::Change& change : store.TakeChanges()) {
    const Metric& metric = store.All()[change.index];
    sparkplug_b::Metric& out = *payload.add_metrics();
    out.set_alias(change.index + 1);
    out.set_timestamp(static_cast<std::uint64_t>(metric.utc_ms > 0 ? metric.utc_ms : now_ms));
    if (metric.historical) out.set_is_historical(true);
    PutValue(metric, out);
    if (change.quality) PutQuality(metric.quality, out);
  }
  return payload.SerializeAsString();
}

std::string NodeDeath(int bdSeq, std::int64_t now_ms) {
  sparkplug_b::Payload payload;
  PutSequence(bdSeq, now_ms, payload);
  return payload.SerializeAsString();
}

Result<Command> CommandFromPayload(std::string_view payload) {
  if (payload.size() > kMaxCommand_bytes) return Error{"longer than 64 kB"};
  sparkplug_b::Payload parsed;
  if (!parsed.ParseFromArray(payload.data(), static_cast<int>(payload.size())))
    return Error{"not a Sparkplug B payload"};
  Command command;
  for (const sparkplug_b::Metric& metric : parsed.metrics()) {
    if (metric.name() == kRebirth) {
      command.rebirth = command.rebirth || metric.boolean_value();
    } else if (command.ignored.size() < kMaxIgnored) {
      command.ignored.push_back(metric.name().substr(0, kMaxNameInLog));
    }
  }
  return command;
}

std::optional<HostState> HostStateFromText(std::string_view text) {
  if (text.size() > kMaxCommand_bytes) return std::nullopt;
  const auto json = text::JsonOrNull(text);
  if (!json.is_object()) return std::nullopt;
  const auto online = json.find("online"), time = json.find("timestamp");
  if (online == json.end() || !online->is_boolean() || time == json.end()) return std::nullopt;
  const auto utc_ms = text::IntegerFromJsonIfValid<std::int64_t>(*time);
  if (!utc_ms) return std::nullopt;
  return HostState{online->get<bool>(), *utc_ms};
}

}  // namespace plumbline::plant
