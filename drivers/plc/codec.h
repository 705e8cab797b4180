// PLC codec: encodes a snapshot into registers and decodes the command window. Pure.
#pragma once

#include <optional>
#include <vector>

#include "drivers/plc/register_map.h"

namespace plumbline::plc {

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
