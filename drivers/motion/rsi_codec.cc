#include "drivers/motion/rsi_codec.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::motion_link {
namespace {

constexpr int kDeepest = 4;
constexpr std::size_t kLongestDatagram = 8192;

bool IsSpace(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

bool IsNameCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '.' || c == '-' || c == ':';
}

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsSpace(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsSpace(text.back())) text.remove_suffix(1);
  return text;
}

std::optional<std::uint64_t> WholeFrom(std::string_view text) {
  text = Trimmed(text);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> FiniteFrom(std::string_view text) {
  text = Trimmed(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

struct Attribute {
  std::string_view name, value;
};

/// Cursor over the tags of a document; the first fault ends it.
class XmlCursor {
 public:
  explicit XmlCursor(std::string_view text) : rest_(text) {}

  struct Tag {
    std::string_view name;
    std::string_view text_before;  ///< between the previous tag and this one
    bool closing = false;          ///< </name>
    bool empty = false;            ///< <name/>
  };

  /// The next tag up to its attributes; false at the end or at a fault.
  bool NextTag(Tag& tag) {
    const std::size_t open = rest_.find('<');
    if (open == std::string_view::npos) {
      faulty_ = !Trimmed(rest_).empty();
      return false;
    }
    tag = {};
    tag.text_before = rest_.substr(0, open);
    rest_.remove_prefix(open + 1);
    if (rest_.starts_with('?')) {
      const std::size_t end = rest_.find("?>");
      if (end == std::string_view::npos) return Fail();
      rest_.remove_prefix(end + 2);
      return NextAfterDeclaration(tag);
    }
    tag.closing = Take('/');
    tag.name = TakeName();
    return !tag.name.empty() || Fail();
  }

  /// The next attribute of an opening tag; false at the end of the tag or at a fault.
  bool NextAttribute(Tag& tag, Attribute& attribute) {
    SkipSpace();
    if (!tag.closing && Take('/')) tag.empty = true;
    if (Take('>')) return false;
    if (tag.closing || tag.empty) return Fail();
    attribute.name = TakeName();
    SkipSpace();
    if (attribute.name.empty() || !Take('=')) return Fail();
    SkipSpace();
    if (rest_.empty() || (rest_.front() != '"' && rest_.front() != '\'')) return Fail();
    const std::size_t end = rest_.find(rest_.front(), 1);
    if (end == std::string_view::npos) return Fail();
    attribute.value = rest_.substr(1, end - 1);
    rest_.remove_prefix(end + 1);
    return attribute.value.find('<') == std::string_view::npos || Fail();
  }

  bool faulty() const { return faulty_; }

 private:
  bool NextAfterDeclaration(Tag& tag) {
    if (declared_) return Fail();
    declared_ = true;
    return NextTag(tag);
  }
  bool Fail() {
    faulty_ = true;
    rest_ = {};
    return false;
  }
  bool Take(char c) {
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void SkipSpace() {
    while (!rest_.empty() && IsSpace(rest_.front())) rest_.remove_prefix(1);
  }
  std::string_view TakeName() {
    std::size_t size = 0;
    while (size < rest_.size() && IsNameCharacter(rest_[size])) ++size;
    const std::string_view name = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return name;
  }

  std::string_view rest_;
  bool faulty_ = false, declared_ = false;
};

/// Collects A1, A2, .. of one element; joints without a gap from A1 on.
class JointAttributes {
 public:
  /// @return  false if the joint is given twice
  bool Add(const Attribute& attribute) {
    if (attribute.name.size() < 2 || attribute.name.front() != 'A') return true;
    const auto index = WholeFrom(attribute.name.substr(1));
    if (!index || *index < 1 || *index > values_.size()) return true;
    std::optional<double>& value = values_[static_cast<std::size_t>(*index - 1)];
    if (given_[static_cast<std::size_t>(*index - 1)]) return false;
    given_[static_cast<std::size_t>(*index - 1)] = true;
    value = FiniteFrom(attribute.value);
    return true;
  }
  /// Empty if a joint is missing or not a number.
  void CopyTo(model::JointVector& q) const {
    q.resize(0);
    const auto count = static_cast<std::size_t>(std::count(given_.begin(), given_.end(), true));
    for (std::size_t k = 0; k < count; ++k) {
      if (!values_[k]) return;
    }
    q.resize(static_cast<Eigen::Index>(count));
    for (std::size_t k = 0; k < count; ++k) {
      q[static_cast<Eigen::Index>(k)] = kRadPerDeg * *values_[k];
    }
  }

 private:
  std::array<std::optional<double>, model::kMaxJoints> values_;
  std::array<bool, model::kMaxJoints> given_{};
};

constexpr std::string_view kNotXml = "not the XML of RSI";
constexpr std::string_view kTwice = "an element or a joint occurs twice";

}  // namespace

std::string_view RsiCodec::Parse(std::string_view datagram, RobotPacket& packet) const {
  if (datagram.size() > kLongestDatagram) return "too long";
  // Some senders end their text with a zero byte.
  while (!datagram.empty() && datagram.back() == '\0') datagram.remove_suffix(1);
  packet = {};
  XmlCursor xml(datagram);
  XmlCursor::Tag tag;
  std::array<std::string_view, kDeepest> open;
  std::size_t depth = 0;
  bool root_closed = false, joints_seen = false, delay_seen = false;
  std::optional<std::uint64_t> number;
  JointAttributes joints;
  while (xml.NextTag(tag)) {
    if (tag.closing) {
      if (depth == 0 || open[depth - 1] != tag.name) return kNotXml;
      if (depth == 2 && tag.name == "IPOC") {
        if (number) return kTwice;
        number = WholeFrom(tag.text_before);
        if (!number) return "IPOC is not a whole number";
      }
      root_closed = --depth == 0;
    } else {
      const bool text_outside = depth == 0 && !Trimmed(tag.text_before).empty();
      if (root_closed || text_outside || depth == kDeepest) return kNotXml;
      if (depth == 0 && tag.name != "Rob") return "the element is not Rob";
      open[depth++] = tag.name;
    }
    const bool of_joints = !tag.closing && depth == 2 && tag.name == names_.joints_tag;
    if (of_joints && joints_seen) return kTwice;
    joints_seen = joints_seen || of_joints;
    Attribute attribute;
    while (xml.NextAttribute(tag, attribute)) {
      if (of_joints && !joints.Add(attribute)) return kTwice;
      if (depth == 2 && tag.name == "Delay" && attribute.name == "D" && !delay_seen) {
        delay_seen = true;
        packet.late = WholeFrom(attribute.value);
      }
    }
    if (xml.faulty()) return kNotXml;
    if (tag.empty) root_closed = --depth == 0;
  }
  if (xml.faulty() || depth != 0 || !root_closed) return kNotXml;
  if (!number) return "IPOC is missing";
  packet.number = *number;
  joints.CopyTo(packet.q);
  return {};
}

namespace {

/// Writes into a buffer that is large enough for every answer.
class Writer {
 public:
  explicit Writer(std::span<char> buffer) : buffer_(buffer) {}

  Writer& Text(std::string_view text) {
    const std::size_t size = std::min(text.size(), buffer_.size() - used_);
    std::copy_n(text.begin(), size, buffer_.begin() + static_cast<std::ptrdiff_t>(used_));
    used_ += size;
    return *this;
  }
  /// Six decimals, so that rounding adds less than 1 nm to a step.
  Writer& Fixed(double value) {
    constexpr int kDecimals = 6;
    constexpr double kNothing = 0.5e-6;  // else "-0.000000"
    if (std::abs(value) < kNothing) value = 0;
    const auto [end, error] = std::to_chars(buffer_.data() + used_, buffer_.data() + buffer_.size(),
                                            value, std::chars_format::fixed, kDecimals);
    if (error == std::errc()) used_ = static_cast<std::size_t>(end - buffer_.data());
    return *this;
  }
  Writer& Whole(std::uint64_t value) {
    const auto [end, error] =
        std::to_chars(buffer_.data() + used_, buffer_.data() + buffer_.size(), value);
    if (error == std::errc()) used_ = static_cast<std::size_t>(end - buffer_.data());
    return *this;
  }
  std::size_t size() const { return used_; }

 private:
  std::span<char> buffer_;
  std::size_t used_ = 0;
};

}  // namespace

std::size_t RsiCodec::Encode(const RobotPacket& packet, const motion_offset::Offset& offset,
                             std::span<char, 512> answer) const {
  const Vec3 abc = kDegPerRad * AnglesFromRotation(RotationFromVector(offset.rotation),
                                                   OrientationConvention::kAbc);
  const Vec3 mm = kMmPerMetre * offset.translation;
  Writer to(answer);
  to.Text("<Sen Type=\"").Text(names_.sen_type).Text("\"><").Text(names_.correction_tag);
  to.Text(" X=\"").Fixed(mm.x()).Text("\" Y=\"").Fixed(mm.y()).Text("\" Z=\"").Fixed(mm.z());
  to.Text("\" A=\"").Fixed(abc.x()).Text("\" B=\"").Fixed(abc.y()).Text("\" C=\"").Fixed(abc.z());
  to.Text("\"/><IPOC>").Whole(packet.number).Text("</IPOC></Sen>");
  return to.size();
}

}  // namespace plumbline::motion_link
