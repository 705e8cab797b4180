// MQTT configuration of plumbline-fleet, [mqtt] of plumbline.toml.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace plumbline::config {

class NamedFiles;
class TomlTable;

struct MqttConfig {
  std::string host;
  int port = 1883;       ///< default 8883 with a tls_ca
  std::string tls_ca;    ///< file with the CA certificates that verify the broker; empty: no TLS
  std::string username;  ///< empty: none
  std::string password_file;  ///< the password is its first line; empty: no password
  std::string group = "plumbline", node, client_id;
  double state_period_s = 5;     ///< interval between state messages while nothing changes
  double change_period_s = 1;    ///< shortest interval between messages about one changing value
  double point_change_m = 5e-5;  ///< smallest change of a correction that is published
  std::int64_t queue_bytes = 64'000'000;
  /// A message is kept this long after the broker acknowledged it, and published again if the
  /// connection breaks meanwhile; 0: not kept.
  double repeat_s = 120;
  std::string page_url;  ///< of the cell's page, as the plant reaches it; empty: from [page]
  bool journal = true;   ///< publish the probes of the measurement journal
};

inline constexpr std::size_t kMaxTopicLevel = 64;  ///< bytes
/// Whether a text can be a level of a topic: 1..kMaxTopicLevel bytes without / + # and control
/// characters.
bool IsTopicLevel(std::string_view text);

/// @param cell_name  default of the node; characters not allowed in a topic become '-'
MqttConfig MqttFromToml(const TomlTable& table, const NamedFiles& files,
                        const std::string& cell_name);

}  // namespace plumbline::config
