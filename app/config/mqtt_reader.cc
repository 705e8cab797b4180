#include <fmt/format.h>

#include <algorithm>

#include "app/config/mqtt_config.h"
#include "app/config/named_files.h"
#include "app/config/toml_reader.h"

namespace plumbline {
namespace {

constexpr int kPlainPort = 1883, kTlsPort = 8883;
constexpr NumberRange kStatePeriod{0.2, 3600};
constexpr NumberRange kChangePeriod{0.2, 3600};
constexpr NumberRange kPointChange{0.001, 100, kMetrePerMm};
constexpr std::int64_t kBytesPerMB = 1'000'000;
constexpr std::size_t kLongestName = 64, kLongestHost = 253;

/// What a level of a topic may not hold: separators and wildcards of MQTT, and control characters.
bool IsNoTopic(char c) {
  return c == '/' || c == '+' || c == '#' || static_cast<unsigned char>(c) < ' ' || c == 127;
}

void NameFromToml(const TomlTable& table, const char* key, std::string& name) {
  const auto given = table.String(key);
  if (!given) return;
  name = *given;
  if (name.size() > kLongestName || std::any_of(name.begin(), name.end(), IsNoTopic)) {
    table.AddFault(key, fmt::format("must have 1..{} signs, without / + #", kLongestName));
  }
}

void AddressFromToml(const TomlTable& table, MqttConfig& mqtt) {
  mqtt.host = table.RequiredString("host").value_or("");
  const bool odd =
      mqtt.host.size() > kLongestHost || mqtt.host.find_first_of("/ \t\r\n@") != std::string::npos;
  if (odd) table.AddFault("host", "is not a name or an address alone, such as broker.plant.lan");
  mqtt.port = table.Integer("port", 1, 65535).value_or(mqtt.tls_ca.empty() ? kPlainPort : kTlsPort);
}

void IdentityFromToml(const TomlTable& table, const NamedFiles& files, MqttConfig& mqtt) {
  mqtt.username = table.String("username").value_or("");
  if (const auto file = table.String("password_file")) mqtt.password_file = files.Beside(*file);
  if (table.Has("password")) {
    // The fault must not tell it: faults go to the log.
    table.Ignore({"password"});
    table.AddFault("",
                   "password does not stand here, where many may read: password_file = \"...\"");
  }
  if (!mqtt.password_file.empty() && !table.Has("username")) {
    table.AddFault("password_file", "needs a username");
  }
  if (!mqtt.password_file.empty() && mqtt.tls_ca.empty()) {
    table.AddWarning("password_file", "goes over the network in the clear: a tls_ca keeps it");
  }
}

}  // namespace

MqttConfig MqttFromToml(const TomlTable& table, const NamedFiles& files,
                        const std::string& cell_name) {
  MqttConfig mqtt;
  if (const auto file = table.String("tls_ca")) mqtt.tls_ca = files.Beside(*file);
  AddressFromToml(table, mqtt);
  IdentityFromToml(table, files, mqtt);
  mqtt.node = cell_name.empty() ? "cell" : cell_name.substr(0, kLongestName);
  std::replace_if(mqtt.node.begin(), mqtt.node.end(), IsNoTopic, '-');
  NameFromToml(table, "group", mqtt.group);
  NameFromToml(table, "node", mqtt.node);
  mqtt.client_id = fmt::format("plumbline-{}-{}", mqtt.group, mqtt.node);
  NameFromToml(table, "client_id", mqtt.client_id);
  const auto number = [&table](const char* key, NumberRange range, double& into) {
    into = table.Number(key, range).value_or(into);
  };
  number("state_s", kStatePeriod, mqtt.state_period_s);
  number("change_s", kChangePeriod, mqtt.change_period_s);
  number("point_change_mm", kPointChange, mqtt.point_change_m);
  if (const auto size = table.Integer("queue_mb", 1, 100000))
    mqtt.queue_bytes = *size * kBytesPerMB;
  mqtt.journal = table.Bool("journal").value_or(mqtt.journal);
  return mqtt;
}

}  // namespace plumbline
