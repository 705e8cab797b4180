// The configuration table: every key of plumbline.toml, its range and what it means, once.
//
// Reading, checking, the shipped config/plumbline.toml, the manual's reference and the manual page
// all follow from it. A default is the initial value of the struct that a key is stored in.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/config/daemon_config.h"
#include "app/config/settings.h"

namespace plumbline {

/// The keys beside the tables: cell and state directory.
void ListKeys(Settings& keys, DaemonConfig& config);
void ListKeys(Settings& keys, RobotLinkConfig& robot);
void ListKeys(Settings& keys, PlausibilityLimits& limits);  ///< of [robot] too
void ListKeys(Settings& keys, PayloadPolicy& payload);
void ListKeys(Settings& keys, PayloadPolicy::ToolLoad& tool);
void ListKeys(Settings& keys, PlcConfig& plc);
void ListKeys(Settings& keys, modbus::RtuSlaveOptions& line);
void ListKeys(Settings& keys, CorrectionLimits& limits);
/// @param ids  DaemonConfig::push_ids
void ListKeys(Settings& keys, PushLimits& push, std::vector<int>& ids);
void ListKeys(Settings& keys, LoopConfig& loop);
void ListKeys(Settings& keys, CameraConfig& camera);
/// @param camera  whose device is the default of a zoom that is a control of it
void ListKeys(Settings& keys, ZoomConfig& zoom, const std::string& camera = "");
void ListKeys(Settings& keys, Board& board);        ///< what is printed on it
void ListKeys(Settings& keys, BoardConfig& board);  ///< the others of [board]
void ListKeys(Settings& keys, TagsConfig& tags);
void ListKeys(Settings& keys, OverlayConfig& overlay);
void ListKeys(Settings& keys, PageConfig& page);
void ListKeys(Settings& keys, MqttConfig& mqtt);
/// @param period_s  DaemonConfig::cycle_period_s
void ListCycleKeys(Settings& keys, double& period_s);

/// Values of a [[frame]], or of a [[point]] before its pose is composed.
struct FrameKeys {
  std::string name;
  Vec3 xyz_m = Vec3::Zero(), rpy_rad = Vec3::Zero();
};
struct PointKeys : FrameKeys {
  std::string frame = "measurement";
  std::optional<std::vector<double>> near;  ///< in degrees or mm, as the joint's kind has it
  AssemblyPoint point;
};
void ListKeys(Settings& keys, FrameKeys& frame);
void ListKeys(Settings& keys, PointKeys& placed);

}  // namespace plumbline
