#include "tests/motion_robots/egm_robot.h"

#include <cstring>
#include <map>

namespace motion_robots {
namespace {

// Protocol buffers as their public encoding describes them: a key (number * 8 + type), a value.

std::string Number(std::uint64_t value) {
  std::string bytes;
  do {
    const auto low = static_cast<unsigned char>(value % 128);
    value /= 128;
    bytes += static_cast<char>(value > 0 ? low + 128 : low);
  } while (value > 0);
  return bytes;
}
std::string Whole(unsigned number, std::uint64_t value) {
  return Number(number * 8) + Number(value);
}
std::string EightBytes(double value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);  // both are little-endian
  return bytes;
}
std::string Real(unsigned number, double value) {
  return Number(number * 8 + 1) + EightBytes(value);
}
std::string Nested(unsigned number, const std::string& bytes) {
  return Number(number * 8 + 2) + Number(bytes.size()) + bytes;
}

/// The fields of a message by their numbers, the last of each; empty if it is malformed.
std::map<unsigned, std::string> FieldsOf(const std::string& bytes) {
  std::map<unsigned, std::string> fields;
  std::size_t at = 0;
  const auto number = [&]() -> std::uint64_t {
    std::uint64_t value = 0, weight = 1;
    while (at < bytes.size()) {
      const auto byte = static_cast<unsigned char>(bytes[at++]);
      value += weight * (byte % 128);
      weight *= 128;
      if (byte < 128) return value;
    }
    at = std::string::npos;
    return 0;
  };
  while (at < bytes.size()) {
    const std::uint64_t key = number();
    if (at == std::string::npos) return {};
    std::size_t size = 8;
    if (key % 8 == 0) {
      const std::uint64_t value = number();
      if (at == std::string::npos) return {};
      fields[static_cast<unsigned>(key / 8)] = std::to_string(value);
      continue;
    }
    if (key % 8 == 2) size = static_cast<std::size_t>(number());
    if (key % 8 > 2 || at == std::string::npos || size > bytes.size() - at) return {};
    fields[static_cast<unsigned>(key / 8)] = bytes.substr(at, size);
    at += size;
  }
  return fields;
}

std::uint32_t WholeOf(const std::map<unsigned, std::string>& fields, unsigned number) {
  const auto found = fields.find(number);
  return found == fields.end() ? 0 : static_cast<std::uint32_t>(std::stoull(found->second));
}

std::optional<double> RealOf(const std::map<unsigned, std::string>& fields, unsigned number) {
  const auto found = fields.find(number);
  if (found == fields.end() || found->second.size() != 8) return std::nullopt;
  double value = 0;
  std::memcpy(&value, found->second.data(), 8);
  return value;
}

}  // namespace

std::string EgmRobot::Packet(const std::vector<double>& joints, std::uint64_t number) const {
  const auto seqno = static_cast<std::uint32_t>(number);
  std::string values;
  for (const double joint : joints) values += options_.packed ? EightBytes(joint) : Real(1, joint);
  if (options_.packed) values = Nested(1, values);
  std::string header = Whole(1, seqno) + Whole(2, 4U * seqno);
  if (message_type) header += Whole(3, *message_type);
  std::string feed_back = Nested(1, values);
  const std::string pose = Nested(1, Real(1, 500) + Real(2, 0) + Real(3, 700)) +
                           Nested(2, Real(1, 1) + Real(2, 0) + Real(3, 0) + Real(4, 0));
  if (options_.more_fields) feed_back += Nested(2, pose) + Nested(4, Whole(1, 1700000000));
  std::string bytes = Nested(1, header) + Nested(2, feed_back);
  if (options_.more_fields) {
    bytes += Nested(3, Nested(1, values) + Nested(2, pose)) + Nested(4, Whole(1, 1));
  }
  const MciState told = state == MciState::kRunning && !active ? MciState::kStopped : state;
  if (told != MciState::kUndefined) bytes += Nested(5, Whole(1, static_cast<unsigned>(told)));
  if (options_.more_fields)
    bytes += Whole(6, 1) + Nested(8, Whole(1, 2)) + Real(10, 20.5) + Nested(99, "?");
  return bytes;
}

std::string EgmRobot::BeginCycle() {
  answer_.reset();
  ++seqno_;
  return Packet(joints_deg, seqno_);
}

void EgmRobot::Receive(const std::string& datagram) {
  const auto message = FieldsOf(datagram);
  const auto part = [](const std::map<unsigned, std::string>& fields, unsigned number) {
    const auto found = fields.find(number);
    return found == fields.end() ? std::map<unsigned, std::string>() : FieldsOf(found->second);
  };
  const auto header = part(message, 1);
  constexpr unsigned kPathCorrection = 4;
  if (WholeOf(header, 3) != kPathCorrection || options_.guidance) {
    ++refused_;
    return;
  }
  const auto body = part(message, 2);
  const auto position = part(body, 1);
  const auto x = RealOf(position, 1), y = RealOf(position, 2), z = RealOf(position, 3);
  if (!x || !y || !z || body.count(2) == 0) {  // required fields
    ++refused_;
    return;
  }
  answered_seqno_ = WholeOf(header, 1);
  age_ms_ = WholeOf(body, 2);
  answer_ = Correction{{*x, *y, *z}, {}};  // what arrives last counts
}

void EgmRobot::EndCycle() {
  if (active)
    offset_.EndCycle(answer_);
  else
    offset_.Pause(answer_.has_value());
}

void EgmRobot::Start() {
  answer_.reset();
  offset_.Start();
}

}  // namespace motion_robots
