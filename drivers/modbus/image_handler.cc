#include "drivers/modbus/image_handler.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace plumbline::modbus {
std::optional<Client> MasterWatch::RecordWrite(const Client& writer, double now_s) {
  const auto end = writes_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto own =
      std::find_if(writes_.begin(), end, [&](const Write& w) { return w.client == writer; });
  const bool wrote_before = own != end && now_s - own->time_s <= kConflictWindow_s;
  std::optional<Client> other;
  for (auto write = writes_.begin(); write != end && !other; ++write) {
    if (write->client == writer || now_s - write->time_s > kConflictWindow_s) continue;
    const bool since_own = wrote_before && write < own;  // most recent first
    if (write->client.address != writer.address || since_own) other = write->client;
  }
  const bool room = count_ < kMaxClients;
  if (own == end && room) ++count_;
  const auto last = own == end && !room ? std::prev(end) : own;
  std::move_backward(writes_.begin(), last, std::next(last));
  writes_.front() = {writer, now_s};
  return other;
}

namespace {

double Now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// True if the request wrote anything other than the heartbeat.
bool IsCommand(const PduReply& reply, const AddressRanges::Range& non_command_registers) {
  if (reply.wrote == PduReply::Wrote::kCoils) return true;
  return reply.first < non_command_registers.first ||
         reply.first + reply.count - 1 > non_command_registers.last;
}

}  // namespace

ImageHandler::ImageHandler(const Latest<RegisterImage>& images, const CommandArea& commands,
                           DeviceIdentification identification)
    : images_(images),
      identification_(std::move(identification)),
      commands_{commands, {}, {}},
      published_(1, commands_) {}

std::size_t ImageHandler::Handle(const Client& client, std::span<const std::uint8_t> request,
                                 std::span<std::uint8_t, kMaxPduBytes> response) {
  const std::lock_guard lock(mutex_);
  const auto image = images_.Read();
  const PduReply reply = HandlePdu(request, *image, commands_, identification_, response);
  if (reply.wrote != PduReply::Wrote::kNothing) {
    if (IsCommand(reply, commands_.non_command_registers)) NoteWriter(client);
    published_.Begin() = commands_;
    published_.Publish();
  }
  return reply.size;
}

void ImageHandler::NoteWriter(const Client& client) {
  const double now_s = Now_s();
  commands_.writer = client;
  const std::optional<Client> other = masters_.RecordWrite(client, now_s);
  if (!other) return;
  const bool reported = now_s < commands_.two_masters_until_s;
  commands_.other = *other;
  commands_.two_masters_until_s = now_s + MasterWatch::kConflictWindow_s;
  if (!reported && on_two_masters_) on_two_masters_(client, *other);
}

}  // namespace plumbline::modbus
