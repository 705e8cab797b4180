#include "app/plant/database/copy_rows.h"

#include <array>
#include <bit>
#include <type_traits>

namespace plumbline::plant {
namespace {

constexpr std::int64_t kYear2000_ms = 946'684'800'000;  ///< zero of timestamptz, which counts us
constexpr std::int32_t kFloat8 = 701;                   ///< its oid
constexpr std::string_view kSignature("PGCOPY\n\377\r\n\0", 11);

/// In network order.
template <typename T>
void Append(std::string& bytes, T value) {
  auto bits = static_cast<std::make_unsigned_t<T>>(value);
  std::array<char, sizeof(T)> text;
  for (std::size_t i = sizeof(T); i-- > 0; bits = static_cast<decltype(bits)>(bits >> 8))
    text[i] = static_cast<char>(bits & 0xFF);
  bytes.append(text.data(), text.size());
}

}  // namespace

template <typename T>
CopyRow& CopyRow::Field(T value) {
  Append<std::int32_t>(bytes_, sizeof(T));
  Append(bytes_, value);
  ++fields_;
  return *this;
}

CopyRow& CopyRow::Null() {
  Append<std::int32_t>(bytes_, -1);
  ++fields_;
  return *this;
}

CopyRow& CopyRow::Bool(bool value) {
  return Field(static_cast<std::int8_t>(value));
}
CopyRow& CopyRow::Small(std::int16_t value) {
  return Field(value);
}
CopyRow& CopyRow::Integer(std::int32_t value) {
  return Field(value);
}
CopyRow& CopyRow::Big(std::int64_t value) {
  return Field(value);
}
CopyRow& CopyRow::Real(float value) {
  return Field(std::bit_cast<std::int32_t>(value));
}
CopyRow& CopyRow::Double(double value) {
  return Field(std::bit_cast<std::int64_t>(value));
}
CopyRow& CopyRow::Utc(std::int64_t utc_ms) {
  return Big(1000 * (utc_ms - kYear2000_ms));
}

CopyRow& CopyRow::Text(std::string_view utf8) {
  Append(bytes_, static_cast<std::int32_t>(utf8.size()));
  bytes_ += utf8;
  ++fields_;
  return *this;
}

CopyRow& CopyRow::Json(std::string_view json) {
  Append(bytes_, static_cast<std::int32_t>(json.size() + 1));
  bytes_ += '\1';  // version of the format
  bytes_ += json;
  ++fields_;
  return *this;
}

CopyRow& CopyRow::Doubles(std::span<const double> values) {
  const auto count = static_cast<std::int32_t>(values.size());
  // Dimensions, no NULL inside, type; of the dimension: size and first index.
  const std::int32_t dimensions = count > 0 ? 1 : 0;
  Append<std::int32_t>(bytes_, 12 + dimensions * (8 + 12 * count));
  for (const std::int32_t word : {dimensions, 0, kFloat8}) Append(bytes_, word);
  if (count > 0) {
    for (const std::int32_t word : {count, 1}) Append(bytes_, word);
  }
  for (const double value : values) {
    Append<std::int32_t>(bytes_, sizeof(value));
    Append(bytes_, std::bit_cast<std::int64_t>(value));
  }
  ++fields_;
  return *this;
}

void CopyRows::Add(const CopyRow& begin, const CopyRow& rest) {
  if (bytes_.empty()) {
    bytes_ = kSignature;
    bytes_.append(8, '\0');  // flags, and no extension of the header
  }
  Append(bytes_, static_cast<std::int16_t>(begin.fields() + rest.fields()));
  bytes_ += begin.bytes();
  bytes_ += rest.bytes();
}

const std::string& CopyRows::Finish() {
  Append<std::int16_t>(bytes_, -1);
  return bytes_;
}

}  // namespace plumbline::plant
