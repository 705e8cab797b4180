// Answers requests from the newest image, and hands what clients wrote to the cycle.
#pragma once

#include <mutex>

#include "drivers/latest.h"
#include "drivers/modbus/pdu.h"

namespace plumbline::modbus {

/// Shared by all transports. Each request is answered from one image and cannot see another's
/// half-done write. The cycle side never waits: it publishes images and reads the newest commands
/// through Latest; the mutex is between transports only.
class ImageHandler : public RequestHandler {
 public:
  /// @param images    the transports together hold one guard at a time
  /// @param commands  initial content, addresses included
  ImageHandler(const Latest<RegisterImage>& images, const CommandArea& commands,
               DeviceIdentification identification);

  std::size_t Handle(std::span<const std::uint8_t> request,
                     std::span<std::uint8_t, kMaxPduBytes> response) override;

  /// What clients have written, by whole requests. One reader: the cycle.
  Latest<CommandArea>::Guard Commands() const { return published_.Read(); }

 private:
  const Latest<RegisterImage>& images_;
  const DeviceIdentification identification_;
  std::mutex mutex_;  ///< of commands_ and of the writing side of published_
  CommandArea commands_;
  Latest<CommandArea> published_;
};

}  // namespace plumbline::modbus
