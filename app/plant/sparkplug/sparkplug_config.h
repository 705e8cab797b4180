// Configuration of plumbline-sparkplug: [broker] and [sparkplug] of plant.toml.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"

namespace plumbline::plant {

/// A broker and how to log in.
struct BrokerAddress {
  std::string host;
  int port = 1883;            ///< default 8883 with a tls_ca
  std::string tls_ca;         ///< file with the CA certificates that verify it; empty: no TLS
  std::string username;       ///< empty: none
  std::string password_file;  ///< the password is its first line; empty: no password
};

struct SparkplugConfig {
  BrokerAddress cells;  ///< where the cells publish
  BrokerAddress hosts;  ///< where the edge nodes publish; [sparkplug.broker], else the same
  std::string client_id = "plumbline-sparkplug";
  std::string primary_host;  ///< births wait until this host is online; empty: they do not
  int max_nodes = 2000;
};

/// @param file  its path; the files that it names are relative to its folder
std::optional<SparkplugConfig> SparkplugConfigFromText(std::string_view text,
                                                       const std::string& file,
                                                       config::FaultList& faults);
std::optional<SparkplugConfig> ReadSparkplugConfig(const std::string& file,
                                                   config::FaultList& faults);

}  // namespace plumbline::plant
