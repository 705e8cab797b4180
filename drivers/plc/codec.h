// The PLC's codec: a snapshot becomes registers, registers become a command. Pure.
#pragma once

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

  std::size_t size() const { return registers_.size(); }

 private:
  void EncodeCamera(MapSource source, std::size_t camera);
  void Put(std::uint16_t address, FieldType type, double value);

  PlcConvention convention_;
  std::vector<std::uint16_t> point_ids_;
  std::vector<std::uint16_t> registers_;
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
