// Snapshot of the registers of a running daemon, read over Modbus TCP.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/plc/register_map.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// The values are those at the time of Read(); blocks that were read by separate requests may come
/// from different cycles.
class DaemonRegisters {
 public:
  /// Reads all registers that the daemon serves.
  /// @param host  name or address; @param port  TCP port of the daemon's Modbus server
  /// @return      place, reason and remedy on failure: nothing listens there, another server does,
  ///              the connection broke
  static Result<DaemonRegisters> Read(const std::string& host, int port);

  // Values in the units of the register map, by the names in it; an unknown name fails an
  // assertion.
  int points() const { return Word("points"); }
  double Value(std::string_view name) const { return Find(plc::registers::Fields(), name, 0); }
  double Value(std::string_view name, int point) const {
    return Find(plc::registers::PointFields(), name,
                plc::registers::kPoints + plc::registers::kPointSize * point);
  }
  bool has_postures() const { return postures_; }
  double Posture(std::string_view name, int point) const {
    return Find(plc::registers::PostureFields(), name,
                plc::registers::kPostures + plc::registers::kPostureSize * point);
  }
  int cameras() const { return cameras_; }
  double Camera(std::string_view name, int camera) const {
    return Find(plc::registers::CameraFields(), name, plc::registers::kCameraStride * camera);
  }
  double Scene(std::string_view name) const { return Find(plc::registers::SceneFields(), name, 0); }
  double MotionLink(std::string_view name) const {
    return Find(plc::registers::MotionLinkFields(), name, 0);
  }
  int gauges() const { return gauges_; }
  double Gauge(std::string_view name, int gauge) const {
    return Find(plc::registers::GaugeFields(), name,
                plc::registers::kGauges + plc::registers::kGaugeSize * gauge);
  }
  double Body(std::string_view name, int camera, int body) const {
    return Find(plc::registers::BodyFields(), name,
                plc::registers::kBodies + plc::registers::kCameraStride * camera +
                    plc::registers::kBodySize * body);
  }
  /// Configured name; empty if the camera has none.
  std::string CameraName(int camera) const;
  std::string GaugeName(int gauge) const;
  /// False until the gauge sends its first reading.
  bool HasGaugeReading(int gauge) const;
  int Word(std::string_view name) const { return static_cast<int>(Value(name)); }
  bool Status(int bit) const { return (Word("status") & bit) != 0; }

 private:
  double Find(std::span<const plc::MapField> fields, std::string_view name, int base) const;

  std::vector<std::uint16_t> registers_;
  int cameras_ = 0;        ///< number of configured cameras
  int gauges_ = 0;         ///< number of configured gauges
  bool postures_ = false;  ///< the daemon has posture blocks
};

}  // namespace plumbline::cli
