#include <fmt/format.h>

#include <algorithm>

#include "app/config/daemon_settings.h"

namespace plumbline {
namespace {

constexpr int kTlsPort = 8883;
constexpr std::size_t kLongestName = 64, kLongestHost = 253;

/// What a level of a topic may not hold: separators and wildcards of MQTT, and control characters.
bool IsNoTopic(char c) {
  return c == '/' || c == '+' || c == '#' || static_cast<unsigned char>(c) < ' ' || c == 127;
}

void CheckName(const TomlTable& table, const char* key, const std::string& name) {
  if (!table.Has(key)) return;
  if (name.size() > kLongestName || std::any_of(name.begin(), name.end(), IsNoTopic)) {
    table.AddFault(key, fmt::format("must have 1..{} signs, without / + #", kLongestName));
  }
}

void CheckPassword(const TomlTable& table, const MqttConfig& mqtt) {
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
  if (table.Has("tls_ca")) mqtt.port = kTlsPort;
  mqtt.node = cell_name.empty() ? "cell" : cell_name.substr(0, kLongestName);
  std::replace_if(mqtt.node.begin(), mqtt.node.end(), IsNoTopic, '-');
  ReadKeys(table, mqtt, &files);
  const bool odd =
      mqtt.host.size() > kLongestHost || mqtt.host.find_first_of("/ \t\r\n@") != std::string::npos;
  if (odd) table.AddFault("host", "is not a name or an address alone, such as broker.plant.lan");
  CheckPassword(table, mqtt);
  CheckName(table, "group", mqtt.group);
  CheckName(table, "node", mqtt.node);
  CheckName(table, "client_id", mqtt.client_id);
  if (mqtt.client_id.empty()) {
    mqtt.client_id = fmt::format("plumbline-{}-{}", mqtt.group, mqtt.node);
  }
  return mqtt;
}

}  // namespace plumbline
