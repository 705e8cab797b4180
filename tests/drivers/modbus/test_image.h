// Register map used by the tests of this folder.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/modbus/image_handler.h"

namespace plumbline::modbus {

/// Readable 0..19 and 100..239 (register k holds k + offset), commands 1000..1039, bits 0..15
/// (every third is set), coils 20..27.
inline RegisterImage TestImage(std::uint16_t offset = 0) {
  RegisterImage image;
  image.readable = std::make_shared<AddressRanges>(
      std::vector<AddressRanges::Range>{{100, 199}, {0, 19}, {200, 239}});
  for (int k = 0; k < 240; ++k) {
    image.registers.push_back(static_cast<std::uint16_t>(k + offset));
  }
  for (int k = 0; k < 16; ++k) image.bits.push_back(k % 3 == 0 ? 1 : 0);
  return image;
}

inline CommandArea TestCommands() {
  CommandArea commands;
  commands.registers = {.first = 1000, .values = std::vector<std::uint16_t>(40)};
  commands.coils = {.first = 20, .values = std::vector<std::uint8_t>(8)};
  return commands;
}

inline DeviceIdentification TestIdentification() {
  return {{{0, "Maker"}, {1, "Product"}, {2, "1.0"}, {3, "https://example.org"}, {5, "Model"}}};
}

/// Handler with the map above, and the publisher's side of it.
struct TestDevice {
  Latest<RegisterImage> images{2, TestImage()};
  ImageHandler handler{images, TestCommands(), TestIdentification()};

  void Publish(std::uint16_t offset) {
    images.Begin() = TestImage(offset);
    images.Publish();
  }
};

}  // namespace plumbline::modbus
