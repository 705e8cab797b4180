#include "drivers/modbus/pdu.h"

#include <algorithm>
#include <cstring>

namespace plumbline::modbus {
namespace {

using Bytes = std::span<const std::uint8_t>;
using Wrote = PduReply::Wrote;

/// Context of one request: everything the functions need, and the two common ways to answer.
struct Call {
  Bytes request;
  const RegisterImage& image;
  CommandArea& commands;
  const DeviceIdentification& identification;
  std::span<std::uint8_t, kMaxPduBytes> response;

  std::uint16_t Word(std::size_t offset) const {
    return static_cast<std::uint16_t>((request[offset] << 8) | request[offset + 1]);
  }
  PduReply Refuse(Exception exception) const {
    return {.size = WriteException(request[0], exception, response)};
  }
  /// Responds with the first `size` bytes of the request, as the write functions do.
  PduReply Echo(std::size_t size, Wrote wrote, std::uint16_t first, std::uint16_t count) const {
    std::copy_n(request.begin(), size, response.begin());
    return {.size = size, .wrote = wrote, .first = first, .count = count};
  }
};

Exception FindRegisters(const Call& call, std::uint16_t first, int count,
                        const std::uint16_t*& source) {
  if (call.commands.registers.Contains(first, count)) {
    source = call.commands.registers.At(first);
    return Exception::kNone;
  }
  const RegisterImage& image = call.image;
  if (image.readable == nullptr) return Exception::kServerFailure;
  if (!image.readable->Contains(first, count)) return Exception::kIllegalAddress;
  if (first + count > static_cast<int>(image.registers.size())) return Exception::kServerFailure;
  source = image.registers.data() + first;
  return Exception::kNone;
}

Exception FindBits(const Call& call, std::uint16_t first, int count, const std::uint8_t*& source) {
  if (call.commands.coils.Contains(first, count)) {
    source = call.commands.coils.At(first);
    return Exception::kNone;
  }
  if (first + count > static_cast<int>(call.image.bits.size())) return Exception::kIllegalAddress;
  source = call.image.bits.data() + first;
  return Exception::kNone;
}

PduReply AnswerRegisters(const Call& call, const std::uint16_t* source, int count) {
  std::uint8_t* out = call.response.data();
  out[0] = call.request[0];
  out[1] = static_cast<std::uint8_t>(2 * count);
  for (int i = 0; i < count; ++i) {
    out[2 + 2 * i] = static_cast<std::uint8_t>(source[i] >> 8);
    out[3 + 2 * i] = static_cast<std::uint8_t>(source[i] & 0xFF);
  }
  return {.size = 2 + 2 * static_cast<std::size_t>(count)};
}

PduReply ReadRegisters(const Call& call) {
  if (call.request.size() != 5) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t first = call.Word(1), count = call.Word(3);
  if (count < 1 || count > 125) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t* source = nullptr;
  const Exception exception = FindRegisters(call, first, count, source);
  if (exception != Exception::kNone) return call.Refuse(exception);
  return AnswerRegisters(call, source, count);
}

PduReply ReadBits(const Call& call) {
  if (call.request.size() != 5) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t first = call.Word(1), count = call.Word(3);
  if (count < 1 || count > 2000) return call.Refuse(Exception::kIllegalValue);
  const std::uint8_t* source = nullptr;
  const Exception exception = FindBits(call, first, count, source);
  if (exception != Exception::kNone) return call.Refuse(exception);
  const std::size_t bytes = (count + 7U) / 8U;
  std::uint8_t* out = call.response.data();
  out[0] = call.request[0];
  out[1] = static_cast<std::uint8_t>(bytes);
  std::memset(out + 2, 0, bytes);
  for (unsigned i = 0; i < count; ++i) {
    out[2 + i / 8] = static_cast<std::uint8_t>(out[2 + i / 8] | ((source[i] & 1U) << (i % 8)));
  }
  return {.size = 2 + bytes};
}

void StoreRegisters(const Call& call, std::uint16_t first, int count, std::size_t offset) {
  std::uint16_t* target = call.commands.registers.At(first);
  for (int i = 0; i < count; ++i) target[i] = call.Word(offset + 2 * static_cast<std::size_t>(i));
}

PduReply WriteSingleCoil(const Call& call) {
  if (call.request.size() != 5) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t address = call.Word(1), value = call.Word(3);
  if (value != 0x0000 && value != 0xFF00) return call.Refuse(Exception::kIllegalValue);
  if (!call.commands.coils.Contains(address, 1)) return call.Refuse(Exception::kIllegalAddress);
  *call.commands.coils.At(address) = value != 0 ? 1 : 0;
  return call.Echo(5, Wrote::kCoils, address, 1);
}

PduReply WriteSingleRegister(const Call& call) {
  if (call.request.size() != 5) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t address = call.Word(1);
  if (!call.commands.registers.Contains(address, 1)) return call.Refuse(Exception::kIllegalAddress);
  StoreRegisters(call, address, 1, 3);
  return call.Echo(5, Wrote::kRegisters, address, 1);
}

PduReply WriteCoils(const Call& call) {
  if (call.request.size() < 6) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t first = call.Word(1), count = call.Word(3);
  const std::size_t bytes = (count + 7U) / 8U;
  if (count < 1 || count > 1968 || call.request[5] != bytes || call.request.size() != 6 + bytes) {
    return call.Refuse(Exception::kIllegalValue);
  }
  if (!call.commands.coils.Contains(first, count)) return call.Refuse(Exception::kIllegalAddress);
  std::uint8_t* target = call.commands.coils.At(first);
  for (unsigned i = 0; i < count; ++i) {
    target[i] = static_cast<std::uint8_t>((call.request[6 + i / 8] >> (i % 8)) & 1U);
  }
  return call.Echo(5, Wrote::kCoils, first, count);
}

PduReply WriteRegisters(const Call& call) {
  if (call.request.size() < 6) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t first = call.Word(1), count = call.Word(3);
  if (count < 1 || count > 123 || call.request[5] != 2 * count ||
      call.request.size() != 6U + 2U * count) {
    return call.Refuse(Exception::kIllegalValue);
  }
  if (!call.commands.registers.Contains(first, count)) {
    return call.Refuse(Exception::kIllegalAddress);
  }
  StoreRegisters(call, first, count, 6);
  return call.Echo(5, Wrote::kRegisters, first, count);
}

/// value = (value AND and_mask) OR (or_mask AND NOT and_mask)
PduReply MaskWriteRegister(const Call& call) {
  if (call.request.size() != 7) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t address = call.Word(1), and_mask = call.Word(3), or_mask = call.Word(5);
  if (!call.commands.registers.Contains(address, 1)) return call.Refuse(Exception::kIllegalAddress);
  std::uint16_t& value = *call.commands.registers.At(address);
  value = static_cast<std::uint16_t>((value & and_mask) | (or_mask & ~and_mask));
  return call.Echo(7, Wrote::kRegisters, address, 1);
}

PduReply ReadWriteRegisters(const Call& call) {
  if (call.request.size() < 10) return call.Refuse(Exception::kIllegalValue);
  const std::uint16_t read_first = call.Word(1), read_count = call.Word(3);
  const std::uint16_t write_first = call.Word(5), write_count = call.Word(7);
  if (read_count < 1 || read_count > 125 || write_count < 1 || write_count > 121 ||
      call.request[9] != 2 * write_count || call.request.size() != 10U + 2U * write_count) {
    return call.Refuse(Exception::kIllegalValue);
  }
  const std::uint16_t* source = nullptr;
  const Exception exception = FindRegisters(call, read_first, read_count, source);
  if (exception != Exception::kNone) return call.Refuse(exception);
  if (!call.commands.registers.Contains(write_first, write_count)) {
    return call.Refuse(Exception::kIllegalAddress);
  }
  StoreRegisters(call, write_first, write_count, 10);
  PduReply reply = AnswerRegisters(call, source, read_count);
  reply.wrote = Wrote::kRegisters;
  reply.first = write_first;
  reply.count = write_count;
  return reply;
}

constexpr std::uint8_t kReadDeviceIdentification = 14;  // the MEI type of function 43
constexpr std::size_t kMaxObjectBytes = kMaxPduBytes - 9;

void AppendObject(const Call& call, const DeviceIdentification::Object& object, PduReply& reply) {
  const std::size_t length = std::min(object.value.size(), kMaxObjectBytes);
  call.response[reply.size] = object.id;
  call.response[reply.size + 1] = static_cast<std::uint8_t>(length);
  std::memcpy(call.response.data() + reply.size + 2, object.value.data(), length);
  reply.size += 2 + length;
  ++call.response[6];
}

/// The header is function, MEI type, access code, conformity level, more follows, next object id,
/// number of objects. [V1.1b3, 6.21]
PduReply ReadIdentification(const Call& call) {
  if (call.request.size() < 2) return call.Refuse(Exception::kIllegalValue);
  if (call.request[1] != kReadDeviceIdentification) {
    return call.Refuse(Exception::kIllegalFunction);
  }
  if (call.request.size() != 4) return call.Refuse(Exception::kIllegalValue);
  const std::uint8_t access = call.request[2], wanted = call.request[3];
  if (access < 1 || access > 4) return call.Refuse(Exception::kIllegalValue);

  const auto& objects = call.identification.objects;
  const int highest = objects.empty() ? 0 : objects.back().id;
  const std::uint8_t conformity = highest >= 0x80 ? 0x83 : highest > 2 ? 0x82 : 0x81;
  const std::uint8_t header[] = {call.request[0], call.request[1], access, conformity, 0, 0, 0};
  std::copy(std::begin(header), std::end(header), call.response.begin());
  PduReply reply{.size = sizeof header};

  auto object =
      std::find_if(objects.begin(), objects.end(), [&](const auto& o) { return o.id == wanted; });
  if (access == 4) {
    if (object == objects.end()) return call.Refuse(Exception::kIllegalAddress);
    AppendObject(call, *object, reply);
    return reply;
  }
  const int last_id = access == 1 ? 0x02 : access == 2 ? 0x7F : 0xFF;
  // For an unknown object id the specification requires starting at the first object.
  if (object == objects.end() || object->id > last_id) object = objects.begin();
  for (; object != objects.end() && object->id <= last_id; ++object) {
    const std::size_t length = std::min(object->value.size(), kMaxObjectBytes);
    if (reply.size + 2 + length > kMaxPduBytes) {
      call.response[4] = 0xFF;
      call.response[5] = object->id;
      break;
    }
    AppendObject(call, *object, reply);
  }
  return reply;
}

}  // namespace

std::size_t WriteException(std::uint8_t function, Exception exception,
                           std::span<std::uint8_t, kMaxPduBytes> response) {
  response[0] = function | 0x80;
  response[1] = static_cast<std::uint8_t>(exception);
  return 2;
}

PduReply HandlePdu(Bytes request, const RegisterImage& image, CommandArea& commands,
                   const DeviceIdentification& identification,
                   std::span<std::uint8_t, kMaxPduBytes> response) {
  if (request.empty()) return {};
  const Call call{request, image, commands, identification, response};
  switch (request[0]) {
    case 1:
    case 2:
      return ReadBits(call);
    case 3:
    case 4:
      return ReadRegisters(call);
    case 5:
      return WriteSingleCoil(call);
    case 6:
      return WriteSingleRegister(call);
    case 15:
      return WriteCoils(call);
    case 16:
      return WriteRegisters(call);
    case 22:
      return MaskWriteRegister(call);
    case 23:
      return ReadWriteRegisters(call);
    case 43:
      return ReadIdentification(call);
    default:
      return call.Refuse(Exception::kIllegalFunction);
  }
}

}  // namespace plumbline::modbus
