#include "app/plant/sparkplug/sparkplug_config.h"

#include <algorithm>
#include <filesystem>

#include "app/base/config/required_file.h"
#include "app/base/config/secret_file.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::plant {
namespace {

constexpr int kTlsPort = 8883, kMaxNodes = 10000;
constexpr std::size_t kMaxHostLength = 253, kMaxIdLength = 64;

bool IsTopicLevel(const std::string& name) {
  return name.size() <= kMaxIdLength && std::all_of(name.begin(), name.end(), [](char c) {
           return c != '/' && c != '+' && c != '#' && static_cast<unsigned char>(c) >= ' ' &&
                  c != 127;
         });
}

void CheckSecrets(const config::TomlTable& table, const BrokerAddress& broker) {
  if (table.Has("password")) {
    // Faults go to the log, so this one must not contain the password.
    table.Ignore({"password"});
    table.AddFault("",
                   "password is not allowed here, where many users can read it; write it to a file "
                   "and give password_file = \"...\"");
  }
  if (broker.password_file.empty()) return;
  if (broker.username.empty()) table.AddFault("password_file", "needs a username");
  if (const auto why = config::WhyExposed(broker.password_file))
    table.AddWarning("password_file", *why);
  if (broker.tls_ca.empty())
    table.AddWarning("password_file", "is sent over the network unencrypted; give a tls_ca");
}

BrokerAddress BrokerFromToml(const config::TomlTable& table, const std::string& file) {
  const auto path = [&](std::string_view key) {
    const auto name = table.String(key);
    if (!name) return std::string();
    return (std::filesystem::path(file).parent_path() / *name).lexically_normal().string();
  };
  BrokerAddress broker;
  broker.host = table.RequiredString("host").value_or("");
  if (broker.host.size() > kMaxHostLength ||
      broker.host.find_first_of("/ \t\r\n@") != std::string::npos) {
    table.AddFault("host", "is not a plain host name or IP address such as broker.plant.lan");
  }
  broker.tls_ca = path("tls_ca");
  broker.port =
      table.Integer("port", 1, 65535).value_or(broker.tls_ca.empty() ? broker.port : kTlsPort);
  broker.username = table.String("username").value_or("");
  broker.password_file = path("password_file");
  CheckSecrets(table, broker);
  return broker;
}

SparkplugConfig ConfigFromToml(const config::TomlTable& root, const std::string& file) {
  SparkplugConfig config;
  if (const auto broker = root.RequiredTable("broker"))
    config.cells = BrokerFromToml(*broker, file);
  config.hosts = config.cells;
  const auto table = root.Table("sparkplug");
  if (!table) return config;
  if (const auto broker = table->Table("broker")) config.hosts = BrokerFromToml(*broker, file);
  config.client_id = table->String("client_id").value_or(config.client_id);
  config.primary_host = table->String("primary_host").value_or("");
  for (const auto& [key, name] :
       {std::pair{"client_id", config.client_id}, {"primary_host", config.primary_host}}) {
    if (!IsTopicLevel(name)) table->AddFault(key, "must have 1..64 characters, without / + #");
  }
  config.max_nodes = table->Integer("max_nodes", 1, kMaxNodes).value_or(config.max_nodes);
  return config;
}

}  // namespace

std::optional<SparkplugConfig> SparkplugConfigFromText(std::string_view text,
                                                       const std::string& file,
                                                       config::FaultList& faults) {
  return config::ReadDocument(text, file, faults, [&](config::TomlDocument& document) {
    // The other programs of the plant have tables in the same file.
    document.Root().Ignore({"database", "collect", "plant", "worker", "prior", "page"});
    return ConfigFromToml(document.Root(), file);
  });
}

std::optional<SparkplugConfig> ReadSparkplugConfig(const std::string& file,
                                                   config::FaultList& faults) {
  const auto text = config::ReadRequiredFile(file, faults);
  return text ? SparkplugConfigFromText(*text, file, faults) : std::nullopt;
}

}  // namespace plumbline::plant
