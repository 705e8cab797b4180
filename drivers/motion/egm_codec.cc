#include "drivers/motion/egm_codec.h"

#include <bit>
#include <cmath>

#include "firmware-like/geometry/units.h"

namespace plumbline::motion_link {
namespace {

// Wire format: a field is a varint key (number << 3 | wire type) and a value.
enum WireType : unsigned { kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5 };

// Field and enumeration numbers of egm.proto version 1.1.
constexpr std::uint32_t kRobotHeader = 1, kRobotFeedBack = 2, kRobotMciState = 5;
constexpr std::uint32_t kHeaderSeqno = 1, kHeaderTm = 2, kHeaderMtype = 3;
constexpr std::uint32_t kFeedBackJoints = 1, kJointsJoints = 1, kMciStateState = 1;
constexpr std::uint32_t kPathCorrHeader = 1, kPathCorrBody = 2, kBodyPos = 1, kBodyAge = 2;
constexpr std::uint64_t kTypeData = 2, kTypePathCorrection = 4;
constexpr std::uint64_t kMciUndefined = 0, kMciError = 1, kMciRunning = 3;

/// Reads the fields of one message, in order; the first fault ends it.
class MessageReader {
 public:
  explicit MessageReader(std::string_view bytes) : rest_(bytes) {}

  struct Field {
    std::uint32_t number = 0;
    unsigned type = 0;
    std::uint64_t value = 0;  ///< of kVarint, kFixed64 and kFixed32
    std::string_view bytes;   ///< of kBytes
  };

  /// @return  false at the end or at a fault
  bool Next(Field& field) {
    if (rest_.empty()) return false;
    field = {};
    const std::uint64_t key = Varint();
    field.number = static_cast<std::uint32_t>(key >> 3U);
    field.type = static_cast<unsigned>(key & 7U);
    if (faulty_ || field.number == 0 || key >> 32U != 0) return Fail();
    switch (field.type) {
      case kVarint:
        field.value = Varint();
        break;
      case kFixed64:
        field.value = Fixed(8);
        break;
      case kFixed32:
        field.value = Fixed(4);
        break;
      case kBytes: {
        const std::uint64_t size = Varint();
        if (size > rest_.size()) return Fail();
        field.bytes = rest_.substr(0, static_cast<std::size_t>(size));
        rest_.remove_prefix(static_cast<std::size_t>(size));
        break;
      }
      default:  // groups
        return Fail();
    }
    return !faulty_;
  }
  bool faulty() const { return faulty_; }

 private:
  bool Fail() {
    faulty_ = true;
    rest_ = {};
    return false;
  }
  std::uint64_t Varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      if (rest_.empty()) break;
      const auto byte = static_cast<unsigned char>(rest_.front());
      rest_.remove_prefix(1);
      value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
      if ((byte & 0x80U) == 0) return value;
    }
    Fail();
    return 0;
  }
  std::uint64_t Fixed(std::size_t size) {
    if (rest_.size() < size) {
      Fail();
      return 0;
    }
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < size; ++k) {
      value |= static_cast<std::uint64_t>(static_cast<unsigned char>(rest_[k])) << (8 * k);
    }
    rest_.remove_prefix(size);
    return value;
  }

  std::string_view rest_;
  bool faulty_ = false;
};

struct Header {
  std::optional<std::uint64_t> number, type;
  std::uint64_t time = 0;
};

bool ReadHeader(std::string_view bytes, Header& header) {
  MessageReader reader(bytes);
  MessageReader::Field field;
  while (reader.Next(field)) {
    if (field.type != kVarint) continue;
    const std::uint64_t low = field.value & 0xFFFFFFFFU;  // uint32: the upper half is dropped
    if (field.number == kHeaderSeqno) header.number = low;
    if (field.number == kHeaderTm) header.time = low;
    if (field.number == kHeaderMtype) header.type = field.value;
  }
  return !reader.faulty();
}

/// The values of the repeated field `joints`, packed or not; too many make them unusable.
struct Joints {
  std::array<double, model::kMaxJoints> values{};
  std::size_t count = 0;

  void Add(std::uint64_t bits) {
    if (count < values.size()) values[count] = std::bit_cast<double>(bits);
    ++count;
  }
  void CopyTo(model::JointVector& q) const {
    q.resize(0);
    if (count > values.size()) return;
    for (std::size_t k = 0; k < count; ++k) {
      if (!std::isfinite(values[k])) return;
    }
    q.resize(static_cast<Eigen::Index>(count));
    for (std::size_t k = 0; k < count; ++k) {
      q[static_cast<Eigen::Index>(k)] = kRadPerDeg * values[k];
    }
  }
};

bool ReadJoints(std::string_view bytes, Joints& joints) {
  MessageReader reader(bytes);
  MessageReader::Field field;
  while (reader.Next(field)) {
    if (field.number != kJointsJoints) continue;
    if (field.type == kFixed64) joints.Add(field.value);
    if (field.type != kBytes) continue;
    constexpr std::size_t kSize = 8;
    if (field.bytes.size() % kSize != 0) return false;
    for (std::size_t at = 0; at < field.bytes.size(); at += kSize) {
      std::uint64_t bits = 0;
      for (std::size_t k = 0; k < kSize; ++k) {
        bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(field.bytes[at + k]))
                << (8 * k);
      }
      joints.Add(bits);
    }
  }
  return !reader.faulty();
}

bool ReadFeedBack(std::string_view bytes, Joints& joints) {
  MessageReader reader(bytes);
  MessageReader::Field field;
  while (reader.Next(field)) {
    if (field.number == kFeedBackJoints && field.type == kBytes &&
        !ReadJoints(field.bytes, joints)) {
      return false;
    }
  }
  return !reader.faulty();
}

bool ReadMciState(std::string_view bytes, std::uint64_t& state) {
  MessageReader reader(bytes);
  MessageReader::Field field;
  while (reader.Next(field)) {
    if (field.number == kMciStateState && field.type == kVarint) state = field.value;
  }
  return !reader.faulty();
}

constexpr std::string_view kNotEgm = "not a message of EGM";

}  // namespace

std::string_view EgmCodec::Parse(std::string_view datagram, RobotPacket& packet) const {
  packet = {};
  Header header;
  Joints joints;
  std::uint64_t state = kMciUndefined;
  MessageReader reader(datagram);
  MessageReader::Field field;
  while (reader.Next(field)) {
    if (field.type != kBytes) continue;
    if (field.number == kRobotHeader && !ReadHeader(field.bytes, header)) return kNotEgm;
    if (field.number == kRobotFeedBack && !ReadFeedBack(field.bytes, joints)) return kNotEgm;
    if (field.number == kRobotMciState && !ReadMciState(field.bytes, state)) return kNotEgm;
  }
  if (reader.faulty()) return kNotEgm;
  if (!header.number) return "the sequence number is missing";
  if (header.type != kTypeData) return "the message type is not that of a robot";
  packet.number = *header.number;
  packet.time = header.time;
  packet.running = needs_running_ ? state == kMciRunning : state != kMciError;
  joints.CopyTo(packet.q);
  return {};
}

namespace {

/// Writes fields into a buffer that is large enough for every message here.
class MessageWriter {
 public:
  explicit MessageWriter(std::span<char> buffer) : buffer_(buffer) {}

  void Varint(std::uint32_t number, std::uint64_t value) {
    Raw(static_cast<std::uint64_t>(number) << 3U | kVarint);
    Raw(value);
  }
  void Double(std::uint32_t number, double value) {
    Raw(static_cast<std::uint64_t>(number) << 3U | kFixed64);
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (unsigned k = 0; k < 8; ++k) Byte(static_cast<unsigned char>(bits >> (8 * k) & 0xFFU));
  }
  void Message(std::uint32_t number, std::string_view bytes) {
    Raw(static_cast<std::uint64_t>(number) << 3U | kBytes);
    Raw(bytes.size());
    for (const char c : bytes) Byte(static_cast<unsigned char>(c));
  }
  std::string_view written() const { return {buffer_.data(), used_}; }

 private:
  void Byte(unsigned char byte) {
    if (used_ < buffer_.size()) buffer_[used_++] = static_cast<char>(byte);
  }
  void Raw(std::uint64_t value) {
    for (; value >= 0x80U; value >>= 7U) Byte(static_cast<unsigned char>(value | 0x80U));
    Byte(static_cast<unsigned char>(value));
  }

  std::span<char> buffer_;
  std::size_t used_ = 0;
};

}  // namespace

std::size_t EgmCodec::Encode(const RobotPacket& packet, const motion_offset::Offset& offset,
                             std::span<char, 512> answer) const {
  const Vec3 mm = kMmPerMetre * offset.translation;
  std::array<char, 64> buffer{};
  MessageWriter whole(answer);
  MessageWriter header(buffer);
  header.Varint(kHeaderSeqno, packet.number);
  header.Varint(kHeaderTm, packet.time);
  header.Varint(kHeaderMtype, kTypePathCorrection);
  whole.Message(kPathCorrHeader, header.written());
  std::array<char, 32> position{};
  MessageWriter pos(position);
  for (std::uint32_t k = 0; k < 3; ++k) pos.Double(k + 1, mm[static_cast<Eigen::Index>(k)]);
  MessageWriter body(buffer);
  body.Message(kBodyPos, pos.written());
  body.Varint(kBodyAge, 0);  // computed from this packet's joints
  whole.Message(kPathCorrBody, body.written());
  return whole.written().size();
}

}  // namespace plumbline::motion_link
