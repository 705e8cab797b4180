#include <fmt/format.h>

#include <algorithm>

#include "app/base/config/daemon_settings.h"
#include "app/base/config/secret_file.h"

namespace plumbline::config {
namespace {

constexpr int kTlsPort = 8883;
constexpr std::size_t kMaxHostLength = 253, kMaxAddressLength = 500;

/// Characters not allowed in a topic level: MQTT separators and wildcards, control characters.
bool IsForbiddenInTopic(char c) {
  return c == '/' || c == '+' || c == '#' || static_cast<unsigned char>(c) < ' ' || c == 127;
}

/// The plant's page makes a link of it.
bool IsWebAddress(const std::string& text) {
  const bool web = text.starts_with("http://") || text.starts_with("https://");
  return web && text.size() <= kMaxAddressLength &&
         std::all_of(text.begin(), text.end(), [](char c) {
           return c > ' ' && c < 127 && c != '"' && c != '<' && c != '>' && c != '\\';
         });
}

void CheckName(const TomlTable& table, const char* key, const std::string& name) {
  if (!table.Has(key)) return;
  if (!name.empty() && !IsTopicLevel(name)) {
    table.AddFault(key, fmt::format("must have 1..{} characters, without / + #", kMaxTopicLevel));
  }
}

void CheckPassword(const TomlTable& table, const MqttConfig& mqtt) {
  if (table.Has("password")) {
    // Faults go to the log, so this one must not contain the password.
    table.Ignore({"password"});
    table.AddFault("",
                   "password is not allowed here, where many users can read it; write it to a file "
                   "and give password_file = \"...\"");
  }
  if (!mqtt.password_file.empty() && !table.Has("username")) {
    table.AddFault("password_file", "needs a username");
  }
  if (const auto why = WhyExposed(mqtt.password_file)) {
    table.AddWarning("password_file", *why);
  }
  if (!mqtt.password_file.empty() && mqtt.tls_ca.empty()) {
    table.AddWarning("password_file",
                     "is sent over the network unencrypted; give a tls_ca to use TLS");
  }
}

}  // namespace

bool IsTopicLevel(std::string_view text) {
  return !text.empty() && text.size() <= kMaxTopicLevel &&
         std::none_of(text.begin(), text.end(), IsForbiddenInTopic);
}

MqttConfig MqttFromToml(const TomlTable& table, const NamedFiles& files,
                        const std::string& cell_name) {
  MqttConfig mqtt;
  if (table.Has("tls_ca")) mqtt.port = kTlsPort;
  mqtt.node = cell_name.empty() ? "cell" : cell_name.substr(0, kMaxTopicLevel);
  std::replace_if(mqtt.node.begin(), mqtt.node.end(), IsForbiddenInTopic, '-');
  ReadKeys(table, mqtt, &files);
  const bool not_a_host = mqtt.host.size() > kMaxHostLength ||
                          mqtt.host.find_first_of("/ \t\r\n@") != std::string::npos;
  if (not_a_host) {
    table.AddFault("host", "is not a plain host name or IP address such as broker.plant.lan");
  }
  if (!mqtt.page_url.empty() && !IsWebAddress(mqtt.page_url)) {
    table.AddFault("page_url", "is not a web address such as https://cell7.plant.example:8443/");
  }
  CheckPassword(table, mqtt);
  CheckName(table, "group", mqtt.group);
  CheckName(table, "node", mqtt.node);
  CheckName(table, "client_id", mqtt.client_id);
  if (mqtt.client_id.empty()) {
    mqtt.client_id = fmt::format("plumbline-{}-{}", mqtt.group, mqtt.node);
  }
  return mqtt;
}

}  // namespace plumbline::config
