// Bridge between the cells' messages and Sparkplug: one subscription, one edge node for each cell.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "app/plant/sparkplug/edge_node.h"
#include "app/plant/sparkplug/kept_points.h"
#include "app/plant/sparkplug/mqtt_client.h"

namespace plumbline::plant {

/// Runs all connections in the thread that calls RunOnce(). Nodes appear with the first message of
/// a cell, and stay until the end of the process.
class Bridge {
 public:
  /// While the cells' broker is away no cell is known to be online: after this time all nodes die.
  static constexpr double kSourceGrace_s = 10;
  /// Connections that are being established at the same time.
  static constexpr int kMaxConnecting = 16;
  /// Of all cells together, so that memory is bounded; further cells have no node.
  static constexpr std::size_t kMaxMetrics = 500'000;

  /// @param points_file  where points are kept across restarts; empty: nowhere
  Bridge(SparkplugConfig config, std::string points_file);

  /// Waits for the network or `wake`, at most 0.2 s, and handles what arrived.
  void RunOnce(int wake);
  /// Publishes the deaths of all nodes, disconnects within two seconds, and writes the file.
  void End();

  std::string Status() const;  ///< one line

 private:
  void ServeSource(short events, double now_s);
  void ConnectSource(double now_s);
  void LoseSource(const std::string& problem, double now_s);
  void Receive(const MqttClient::Received& received, double now_s);
  EdgeNode* NodeOf(const CellAddress& address);
  void UpdateNodes(double now_s);
  void Connect(EdgeNode& node, double now_s);
  void LogNode(EdgeNode& node);
  void LogHosts();
  bool SourceKnown(double now_s) const;
  void ReadPoints();
  void WritePoints();

  const SparkplugConfig config_;
  const std::string points_file_;
  KeptPoints kept_;  ///< of cells without a node yet
  double written_s_ = 0;
  std::unique_ptr<MqttClient> source_;
  BackOff source_back_off_;
  bool source_asked_ = false, source_logged_ = false;
  double source_until_s_ = 0, source_seen_s_ = -1e300;
  std::string source_problem_, hosts_problem_;
  std::map<std::pair<std::string, std::string>, std::unique_ptr<EdgeNode>> nodes_;
  std::uint64_t unreadable_ = 0;
  double kept_alive_s_ = -1e300, connect_s_ = -1e300;
  int connecting_ = 0;
  std::size_t online_ = 0, born_ = 0;  ///< cells; of these, with a birth in force
};

}  // namespace plumbline::plant
