// The daemon's configuration as values: what plumbline.toml says, checked, in SI.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/robot/profile.h"
#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

struct SerialSettings {
  std::string device;
  int baud = 19200;
  char parity = 'E';  ///< 'N', 'E' or 'O'
  int stop_bits = 1;
};

struct RobotLinkConfig {
  enum class Transport { kTcp, kRtu, kReplay };
  Transport transport = Transport::kTcp;
  std::string host = "127.0.0.1";
  int port = 502;
  int unit_id = 1;  ///< defaults to the profile's
  SerialSettings serial;
  std::string replay_file;  ///< a measured.csv whose joints are played
  double timeout_s = 0.1;
  double stale_after_s = 0.1;  ///< older input withdraws validity
  RobotProfile profile;
};

struct ToolLoad {
  int number = 0;
  double mass_kg = 0;
  std::optional<Vec3> cog_F;
};

struct PayloadConfig {
  enum class Source { kRobot, kTable, kFixed };
  Source source = Source::kRobot;
  double mass_kg = 0;           ///< of kFixed
  std::optional<Vec3> cog_F;    ///< of kFixed; absent: the cell's
  std::vector<ToolLoad> table;  ///< of kTable, by the tool number that the profile reads
};

struct PlcConfig {
  std::string listen = "127.0.0.1";
  int port = 502;
  int unit_id = 1;
  bool little_word_first = false;  ///< CDAB instead of ABCD in the whole map
  OrientationConvention orientation = OrientationConvention::kRotationVector;
  int max_clients = 32;
  std::vector<std::string> allow;  ///< client addresses; empty: any
  std::optional<SerialSettings> rtu;
};

struct CorrectionConfig {
  double max_translation_m = 0.05;
  double max_rotation_rad = 0.05;
  double min_singular_value = 0.02;  ///< [m/rad and rad/rad, length scale 1 m]
  double deflection_sd = 0.1;  ///< standard deviation of a declared deflection, as a share of it
};

/// Corrected points written into the controller's registers; where they go is the profile's.
struct PushConfig {
  bool enabled = false;
  std::vector<int> point_ids;  ///< in the order of the profile's slots
  double max_step_m = 0.005;   ///< largest change of a pushed position from one write to the next
  double min_period_s = 0.1;
};

struct DaemonConfig {
  std::string file;  ///< where it was read from
  std::string cell_file;
  CellModel cell;
  RobotLinkConfig robot;
  PayloadConfig payload;
  PlcConfig plc;
  CorrectionConfig correction;
  PushConfig push;
  double cycle_period_s = 0.01;
  std::string state_directory = "/var/lib/plumbline";
  std::vector<AssemblyPoint> points;
};

}  // namespace plumbline
