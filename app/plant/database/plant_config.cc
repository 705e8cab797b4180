#include "app/plant/database/plant_config.h"

#include <libpq-fe.h>

#include <filesystem>
#include <memory>

#include "app/base/config/required_file.h"
#include "app/base/config/secret_file.h"
#include "app/base/config/settings.h"

namespace plumbline::plant {
namespace {

using config::Settings;
using config::TomlTable;

constexpr int kTlsPort = 8883;

void ListKeys(Settings& keys, BrokerSettings& broker) {
  keys.Add("host", broker.host, {"host name or IP address of the plant's broker"});
  keys.Add("port", broker.port, {1, 65535}, {.default_text = "1883; 8883 with tls_ca"});
  keys.Add("tls_ca", broker.tls_ca,
           {"CA certificates that verify the broker; if missing, the connection is not encrypted",
            "\"plant-ca.pem\""});
  keys.Add("username", broker.username, {"used together with password_file", "\"collect\""});
  keys.Add("password_file", broker.password_file,
           {"file with the password in its first line; only the program's user may read it",
            "\"collect-password\""});
}

void ListKeys(Settings& keys, DatabaseSettings& database) {
  keys.Add("connection", database.connection,
           {"libpq connection string; several hosts follow a failover",
            "\"host=db1,db2 target_session_attrs=read-write dbname=plumbline user=collect\""});
}

void ListKeys(Settings& keys, CollectSettings& collect) {
  keys.Add(
      "name", collect.name,
      {"of this collector, unique: the broker keeps its messages under plumbline-collect-NAME"});
  keys.Add(
      "topic", collect.topic,
      {"what this collector reads, for example one line; several collectors may read the same, "
       "each message is stored once",
       "\"plumblineV1/line-1/+/+\""});
  keys.Add("share", collect.share,
           {"name of a shared subscription, if collectors divide the messages among them",
            "\"plumbline\"", "none"});
  keys.Add("messages_per_second", collect.messages_per_second, {1, 10000},
           {"of one cell, by the time in its messages; further ones are refused and counted"});
  keys.Add("messages_per_day", collect.messages_per_day, {1000, 1e9},
           {"of one cell, by arrival; further ones are refused and counted"});
}

/// Whether a libpq connection string states a password.
bool HasPassword(const std::string& connection) {
  const std::unique_ptr<PQconninfoOption, void (*)(PQconninfoOption*)> options(
      PQconninfoParse(connection.c_str(), nullptr), &PQconninfoFree);
  for (const PQconninfoOption* one = options.get(); one != nullptr && one->keyword != nullptr;
       ++one) {
    if (std::string_view(one->keyword) == "password") return one->val != nullptr;
  }
  return false;
}

/// Relative paths are those of the configuration's folder.
void ResolvePath(const std::string& folder, std::string& path) {
  if (!path.empty()) path = (std::filesystem::path(folder) / path).string();
}

}  // namespace

BrokerSettings BrokerFromToml(const TomlTable& table, const std::string& folder) {
  BrokerSettings broker;
  if (table.Has("tls_ca")) broker.port = kTlsPort;
  Settings keys(table);
  ListKeys(keys, broker);
  ResolvePath(folder, broker.tls_ca);
  ResolvePath(folder, broker.password_file);
  if (table.Has("password")) {
    table.Ignore({"password"});
    table.AddFault("", "password is not allowed here; write it to a file and give password_file");
  }
  if (!broker.password_file.empty() && broker.username.empty()) {
    table.AddFault("password_file", "needs a username");
  }
  if (const auto why = config::WhyExposed(broker.password_file)) {
    table.AddWarning("password_file", *why);
  }
  if (!broker.password_file.empty() && broker.tls_ca.empty() && broker.host != "localhost" &&
      broker.host != "127.0.0.1") {
    table.AddWarning("password_file",
                     "is sent over the network unencrypted; give a tls_ca to use TLS");
  }
  return broker;
}

PlantConfig PlantConfigFromToml(const std::string& text, const std::string& file,
                                config::FaultList& faults) {
  const std::string folder = std::filesystem::path(file).parent_path().string();
  const auto read = [&](config::TomlDocument& document) {
    PlantConfig plant;
    const TomlTable root = document.Root();
    root.Ignore({"sparkplug"});
    if (const auto table = root.Table("broker")) plant.broker = BrokerFromToml(*table, folder);
    const auto read_table = [&root](const char* key, auto& settings) {
      const auto table = root.Table(key);
      if (!table) return;
      Settings keys(*table);
      ListKeys(keys, settings);
    };
    read_table("database", plant.database);
    if (HasPassword(plant.database.connection)) {
      root.Table("database")
          ->AddFault("",
                     "connection contains a password, which many users could read here; write it "
                     "to a file "
                     "that only the program's user reads, and give passfile=FILE");
    }
    read_table("collect", plant.collect);
    if (const auto table = root.Table("collect"); table && !plant.collect.share.empty()) {
      table->AddWarning(
          "share",
          "mosquitto 2.0 does not save shared subscriptions: what arrives between its "
          "restart and this collector's next connection is lost, and recorded as a "
          "gap. Several collectors without share lose nothing: each message is "
          "stored once");
    }
    if (const auto table = root.Table("page")) plant.page = config::PageFromToml(*table);
    return plant;
  };
  return config::ReadDocument(text, file, faults, read).value_or(PlantConfig{});
}

PlantConfig ReadPlantConfig(const std::string& file, config::FaultList& faults) {
  const auto text = config::ReadRequiredFile(file, faults);
  return text ? PlantConfigFromToml(*text, file, faults) : PlantConfig{};
}

}  // namespace plumbline::plant
