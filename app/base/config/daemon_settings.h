// Configuration table: every key of plumbline.toml with its range and description.
//
// Single source for reading and checking, the shipped config/plumbline.toml, the reference in
// docs/reference/keys.md and the manual page plumbline.toml(5). A default is the initial value of
// the struct member that a key is stored in.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/base/config/settings.h"
#include "app/base/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

// Reader of the [[gauge]] tables of a configuration.

/// Values of a [[gauge]] table, before the defaults of kind and format are filled in.
struct GaugeKeys {
  std::string artefact, device, usb_id, serial;
  gauge::GaugeKind kind = gauge::GaugeKind::kSerial;
  std::optional<const gauge::GaugeFormat*> format;
  std::optional<int> baud, data_bits, stop_bits;
  std::optional<char> parity;
  gauge::GaugeUnit unit = gauge::GaugeUnit::kMillimetre;
  std::optional<double> sigma_m;
};

/// The gauges in file order. Faults: an artefact that the cell lacks or that is no gauge, two
/// gauges for one artefact or device, an unknown format, impossible settings of the line, keys of
/// the other kind.
/// @param cell  provides the artefacts; null if it could not be read, then they are not checked
std::vector<GaugeConfig> GaugesFromToml(const TomlTable& root, const model::CellModel* cell);

// Reader of [motion]: corrections inside the motion.

/// Values of a [motion] table, before they are checked against each other.
struct MotionKeys {
  enum class Kind { kRsi, kEgm, kEgmGuidance };
  motion_link::MotionSettings settings;
  Kind kind = Kind::kRsi;
  bool relative = false;
  bool only_taught_targets = false;
  std::optional<int> port;
  std::optional<double> timeout_s;
  std::optional<motion_offset::OffsetFrame> frame;
  Vec3 frame_rpy_rad = Vec3::Zero();
};

/// Faults: settings with which an offset could jump, and what an interface does not have.
/// @param cell               null if it could not be read
/// @param targets_corrected  the configuration corrects targets, too: points or pushed points
motion_link::MotionSettings MotionFromToml(const TomlTable& table, const model::CellModel* cell,
                                           bool targets_corrected);

/// Top-level keys, outside any table: cell and state directory.
void ListKeys(Settings& keys, DaemonConfig& config);
void ListKeys(Settings& keys, RobotLinkConfig& robot);
void ListKeys(Settings& keys, PlausibilityLimits& limits);  ///< also part of [robot]
void ListKeys(Settings& keys, PayloadPolicy& payload);
void ListKeys(Settings& keys, PayloadPolicy::ToolLoad& tool);
void ListKeys(Settings& keys, PlcConfig& plc);
void ListKeys(Settings& keys, modbus::RtuSlaveOptions& line);
void ListKeys(Settings& keys, correction::CorrectionLimits& limits);
/// @param ids  DaemonConfig::push_ids
void ListKeys(Settings& keys, robot::PushLimits& push, std::vector<int>& ids);
void ListKeys(Settings& keys, MonitoringConfig& monitoring);
void ListKeys(Settings& keys, GaugeKeys& gauge);
void ListKeys(Settings& keys, MotionKeys& motion);
void ListKeys(Settings& keys, CameraConfig& camera);
/// @param camera  device of the camera: default for a zoom that is one of its V4L2 controls
void ListKeys(Settings& keys, ZoomConfig& zoom, const std::string& camera = "");
void ListKeys(Settings& keys, target::Board& board);  ///< [board]: the printed pattern
void ListKeys(Settings& keys, BoardConfig& board);    ///< [board]: the calibration with it
void ListKeys(Settings& keys, TagsConfig& tags);
void ListKeys(Settings& keys, OverlayConfig& overlay);
void ListKeys(Settings& keys, PageConfig& page);
void ListKeys(Settings& keys, MqttConfig& mqtt);
/// @param period_s  DaemonConfig::cycle_period_s
void ListCycleKeys(Settings& keys, double& period_s);

/// Values of a [[frame]] table.
struct FrameKeys {
  std::string name;
  Vec3 xyz_m = Vec3::Zero(), rpy_rad = Vec3::Zero();
};
/// Values of a [[point]] table; the pose of `point` is composed from them later.
struct PointKeys : FrameKeys {
  std::string frame = "measurement";
  std::optional<std::vector<double>> near;  ///< degrees, or mm for a prismatic joint
  correction::AssemblyPoint point;
};
void ListKeys(Settings& keys, FrameKeys& frame);
void ListKeys(Settings& keys, PointKeys& placed);

}  // namespace plumbline::config
