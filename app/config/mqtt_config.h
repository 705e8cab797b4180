// [mqtt] of plumbline.toml: what plumbline-fleet tells the plant's broker.
#pragma once

#include <cstdint>
#include <string>

namespace plumbline {

class NamedFiles;
class TomlTable;

struct MqttConfig {
  std::string host;
  int port = 1883;     ///< default 8883 with a tls_ca
  std::string tls_ca;  ///< file of the certificates that the broker's is checked by; empty: no TLS
  std::string username;       ///< empty: none
  std::string password_file;  ///< its first line; empty: no password
  std::string group = "plumbline", node, client_id;
  double state_period_s = 5;     ///< from one state to the next where nothing changes
  double change_period_s = 1;    ///< between two messages of one thing that changes
  double point_change_m = 5e-5;  ///< of a correction, to be told
  std::int64_t queue_bytes = 64'000'000;
  bool journal = true;  ///< probes of the measurement journal
};

/// @param cell_name  stands for a node that is not given; signs that no topic may have become '-'
MqttConfig MqttFromToml(const TomlTable& table, const NamedFiles& files,
                        const std::string& cell_name);

}  // namespace plumbline
