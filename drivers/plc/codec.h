// The PLC's codec: a snapshot becomes registers, registers become a command. Pure.
#pragma once

#include <optional>
#include <vector>

#include "drivers/plc/register_map.h"

namespace plumbline {

/// Writes snapshots into a register image by the register map. The image is kept between calls,
/// so that a value that is not finite leaves the registers as they were. Allocates only when built.
class PlcEncoder {
 public:
  /// @param point_ids  the configured points in the order of their blocks, at most kMostPoints
  PlcEncoder(const PlcConvention& convention, std::vector<std::uint16_t> point_ids);

  /// Registers 0..size-1; the gaps of the map are 0 and not readable.
  const std::vector<std::uint16_t>& Encode(const Snapshot& snapshot,
                                           const PlcEnvironment& environment);

  /// Copies the image without the gap before the postures, which is most of it where there are few
  /// points. `image` gets size() registers, zeros in the gap where it had fewer.
  void CopyTo(std::vector<std::uint16_t>& image) const;

  std::size_t size() const { return registers_.size(); }

 private:
  void EncodeCamera(MapSource source, std::size_t camera);
  /// Writes the posture of the k-th point where it has changed: it seldom does.
  void EncodePosture(const MapSource& source, std::size_t k);
  void Put(std::uint16_t address, FieldType type, double value);

  PlcConvention convention_;
  std::vector<std::uint16_t> point_ids_;
  std::vector<std::uint16_t> registers_;
  struct Posture {
    bool valid = false;
    std::uint32_t solutions = 0;
    bool operator==(const Posture&) const = default;
  };
  std::vector<std::optional<Posture>> postures_;  ///< that the image holds, one a point
};

/// One entry read back from registers (by `plumbline status` and the tests); address 0 of `block`
/// is `base`. The inverse of the encoder for finite values in range.
double ValueOfField(FieldType type, std::span<const std::uint16_t> block, std::size_t offset,
                    bool little_word_first);

/// The command window, kCommandsSize registers and kCoilsSize coils, as the PLC wrote it. Numbers
/// that are not finite mark the pose as not valid.
PlcCommand PlcCommandFromRegisters(std::span<const std::uint16_t> window,
                                   std::span<const std::uint8_t> coils,
                                   const PlcConvention& convention);

/// Modbus CRC16 of registers, high byte first.
std::uint16_t CrcOfRegisters(std::span<const std::uint16_t> registers);

}  // namespace plumbline
