// PLC codec: encodes a snapshot into registers and decodes the command window. Pure.
#pragma once

#include <array>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "drivers/plc/register_map.h"

namespace plumbline::plc {

// Table of the command registers 1000..1039, which clients write.

inline constexpr std::array kCommandFields = {
    CommandField{
        1000, FieldType::kU16, "command_code", "code",
        "1 correct a configured point, 2 correct the pose in 1002-1013, 3 correct the pose in "
        "1020-1025, 4 predict where the tip lands for the command pose in 1002-1013, 5 "
        "acknowledge, 6 record a probe (measured tip in 1002-1007, measurement frame), 7 record a "
        "probe (measured tip in 1032-1037, measurement frame), 8 restart the drift monitor, 9 "
        "start a lens calibration, 10 cancel it, 11 record a probe measured by camera, 12 record "
        "that the tip is on the artefact in 1001, 13 record a reading (1002-1003) of the dial "
        "gauge "
        "in 1001, or the distance from the point in 1001"},
    CommandField{1001, FieldType::kU16, "command_point", "",
                 "id of the configured point, for code 1; for codes 12 and 13 the number of the "
                 "[[artefact]] in the cell, from 1"},
    CommandField{1002, FieldType::kFloat, "command_x", "mm",
                 "target pose of the TCP, robot base frame (code 4: command pose; code 6: measured "
                 "tip, measurement frame; code 13: reading or distance); NaN or infinity gives "
                 "result code 10"},
    CommandField{1004, FieldType::kFloat, "command_y", "mm", ""},
    CommandField{1006, FieldType::kFloat, "command_z", "mm", ""},
    CommandField{1008, FieldType::kFloat, "command_rx", "deg",
                 "orientation, convention of register 3"},
    CommandField{1010, FieldType::kFloat, "command_ry", "deg", ""},
    CommandField{1012, FieldType::kFloat, "command_rz", "deg", ""},
    CommandField{1014, FieldType::kFloat, "command_payload", "kg",
                 "payload mass to correct for; 0 or less: the payload in force"},
    CommandField{
        1016, FieldType::kU16, "command_camera", "",
        "camera for codes 9 to 11: 1 the first, 2 the second; 0: for code 9 those that request the "
        "board (all if none does), for code 10 all, for code 11 all that see the tip"},
    CommandField{1018, FieldType::kFloat, "command_qw", "",
                 "w of the orientation if register 3 is 3; the four must have the length 1 (1 %), "
                 "else result code 10"},
    CommandField{1020, FieldType::kI16, "command_x_scaled", "0.1 mm",
                 "target pose of the TCP for code 3, robot base frame"},
    CommandField{1021, FieldType::kI16, "command_y_scaled", "0.1 mm", ""},
    CommandField{1022, FieldType::kI16, "command_z_scaled", "0.1 mm", ""},
    CommandField{1023, FieldType::kI16, "command_rx_scaled", "mrad",
                 "target orientation as a rotation vector, independent of register 3"},
    CommandField{1024, FieldType::kI16, "command_ry_scaled", "mrad", ""},
    CommandField{1025, FieldType::kI16, "command_rz_scaled", "mrad", ""},
    CommandField{1030, FieldType::kU16, "plc_heartbeat", "",
                 "write a different value at least every 2 s"},
    CommandField{1031, FieldType::kU16, "plc_flags", "bits",
                 "bit 0: the cell is in manual operation; bit 1: corrections inside the motion are "
                 "allowed, while the bit is 1 and register 1030 changes"},
    CommandField{1032, FieldType::kI32, "probe_x_fine", "0.001 mm",
                 "measured tip for code 7, measurement frame"},
    CommandField{1034, FieldType::kI32, "probe_y_fine", "0.001 mm", ""},
    CommandField{1036, FieldType::kI32, "probe_z_fine", "0.001 mm", ""},
    CommandField{1039, FieldType::kU16, "command_sequence", "",
                 "write it last: a new value executes the command once"},
};

/// Looks up a command register by name; an unknown name is a compile-time error.
consteval CommandField CommandNamed(std::string_view name) {
  for (const CommandField& field : kCommandFields) {
    if (name == field.name) return field;
  }
  throw std::invalid_argument("no such command register");
}

/// Encodes snapshots into a register image according to the register map. The image is retained
/// between calls: a value that is not finite leaves its registers unchanged. Allocates only in the
/// constructor.
class PlcEncoder {
 public:
  /// @param point_ids  ids of the configured points in the order of their blocks, at most
  /// kMaxPoints
  PlcEncoder(const PlcConvention& convention, std::vector<std::uint16_t> point_ids);

  /// @return  registers 0..size()-1; the gaps of the map hold 0 and are not readable
  const std::vector<std::uint16_t>& Encode(const Snapshot& snapshot,
                                           const PlcEnvironment& environment);

  /// Copies the image but skips the gap before the posture blocks, which is most of the image if
  /// there are few points. `image` is resized to size(); registers that are new are 0.
  void CopyTo(std::vector<std::uint16_t>& image) const;

  std::size_t size() const { return registers_.size(); }

 private:
  void EncodeCamera(MapSource source, std::size_t camera);
  void EncodeGauges(MapSource source);
  /// Encodes the posture of the k-th point only if it has changed, which is rare.
  void EncodePosture(const MapSource& source, std::size_t k);
  void Put(std::uint16_t address, FieldType type, double value);

  PlcConvention convention_;
  std::span<const MapField> fields_;  ///< at fixed addresses
  std::vector<std::uint16_t> point_ids_;
  std::vector<std::uint16_t> registers_;
  struct Posture {
    bool valid = false;
    std::uint32_t solutions = 0;
    bool operator==(const Posture&) const = default;
  };
  std::vector<std::optional<Posture>> postures_;  ///< in the image, one per point
};

/// Decodes one value at `offset` of `block`, for `plumbline status` and the tests. Inverse of the
/// encoder for finite values in range.
double ValueOfField(FieldType type, std::span<const std::uint16_t> block, std::size_t offset,
                    bool little_word_first);

/// Decodes the command window as the PLC wrote it. If a number of the pose is not finite, the pose
/// is marked invalid.
/// @param window  kCommandsSize registers
/// @param coils   kCoilsSize coils
model::PlcCommand PlcCommandFromRegisters(std::span<const std::uint16_t> window,
                                          std::span<const std::uint8_t> coils,
                                          const PlcConvention& convention);

/// Modbus CRC-16 over registers, high byte of each register first.
std::uint16_t CrcOfRegisters(std::span<const std::uint16_t> registers);

}  // namespace plumbline::plc
