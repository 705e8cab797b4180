// Configuration of the plant's programs: broker, database, collector and page of plant.toml.
#pragma once

#include <cstdint>
#include <string>

#include "app/base/config/page_config.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::plant {

/// Where the plant's programs find their configuration by default.
inline constexpr const char* kPlantConfigFile = "/etc/plumbline/plant.toml";

/// [broker]: where messages come from.
struct BrokerSettings {
  std::string host = "localhost";
  int port = 1883;       ///< 8883 with a tls_ca
  std::string tls_ca;    ///< file with the CA certificates that verify the broker; empty: no TLS
  std::string username;  ///< empty: none
  std::string password_file;  ///< the password is its first line; empty: no password
};

/// [database]: where they go.
struct DatabaseSettings {
  /// libpq connection string. Several hosts follow a failover:
  /// "host=db1,db2 target_session_attrs=read-write dbname=plumbline user=collect".
  std::string connection = "dbname=plumbline";
};

/// [collect]: limits of the collector.
struct CollectSettings {
  /// Part of the client id, by which the broker keeps this collector's messages; unique among the
  /// collectors of a broker.
  std::string name = "1";
  std::string topic = "plumblineV1/+/+/+";  ///< filter, such as one line's
  std::string share;             ///< name of a shared subscription; empty: every message of `topic`
  int messages_per_second = 50;  ///< of one cell, by the messages' own time; more are refused
  int messages_per_day = 5'000'000;  ///< of one cell, by arrival
};

/// Port of the plant's page unless [page] says otherwise.
inline constexpr int kPlantPagePort = 8090;

struct PlantConfig {
  BrokerSettings broker;
  DatabaseSettings database;
  CollectSettings collect;
  config::PageConfig page;  ///< [page], as of plumbline.toml
};

/// Reads a [broker] table: another program may have several.
/// @param folder  of the file, to which its paths are relative
BrokerSettings BrokerFromToml(const config::TomlTable& table, const std::string& folder);

/// @param text  of the file; tables that other programs of the plant read are not examined
/// @return      as far as it could be read; to be used only if `faults` has no fault
PlantConfig PlantConfigFromToml(const std::string& text, const std::string& file,
                                config::FaultList& faults);

/// Reads a file. A missing one is a fault.
PlantConfig ReadPlantConfig(const std::string& file, config::FaultList& faults);

}  // namespace plumbline::plant
