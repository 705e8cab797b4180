#include "drivers/modbus/image_handler.h"

#include <utility>

namespace plumbline::modbus {

ImageHandler::ImageHandler(const Latest<RegisterImage>& images, const CommandArea& commands,
                           DeviceIdentification identification)
    : images_(images),
      identification_(std::move(identification)),
      commands_(commands),
      published_(1, commands) {}

std::size_t ImageHandler::Handle(std::span<const std::uint8_t> request,
                                 std::span<std::uint8_t, kMaxPduBytes> response) {
  const std::lock_guard lock(mutex_);
  const auto image = images_.Read();
  const PduReply reply = HandlePdu(request, *image, commands_, identification_, response);
  if (reply.wrote != PduReply::Wrote::kNothing) {
    published_.Begin() = commands_;
    published_.Publish();
  }
  return reply.size;
}

}  // namespace plumbline::modbus
