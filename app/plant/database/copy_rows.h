// Rows in the binary format of COPY, which the server stores without parsing text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace plumbline::plant {

/// The fields of one row. The types are those of the columns: the server checks lengths, not kinds.
class CopyRow {
 public:
  CopyRow() = default;
  /// @param bytes  that the row probably has
  explicit CopyRow(std::size_t bytes) { bytes_.reserve(bytes); }
  CopyRow& Null();
  CopyRow& Bool(bool value);
  CopyRow& Small(std::int16_t value);
  CopyRow& Integer(std::int32_t value);
  CopyRow& Big(std::int64_t value);
  CopyRow& Real(float value);
  CopyRow& Double(double value);
  CopyRow& Text(std::string_view utf8);
  CopyRow& Json(std::string_view json);              ///< jsonb
  CopyRow& Utc(std::int64_t utc_ms);                 ///< timestamptz
  CopyRow& Doubles(std::span<const double> values);  ///< float8[]

  int fields() const { return fields_; }
  const std::string& bytes() const { return bytes_; }

 private:
  template <typename T>
  CopyRow& Field(T value);

  std::string bytes_;
  int fields_ = 0;
};

/// What `COPY ... FROM STDIN (FORMAT binary)` reads.
class CopyRows {
 public:
  /// Adds a row whose fields are those of `begin` and `rest`.
  void Add(const CopyRow& begin, const CopyRow& rest);
  bool empty() const { return bytes_.empty(); }
  /// All rows, complete. Nothing can be added afterwards.
  const std::string& Finish();

 private:
  std::string bytes_;
};

}  // namespace plumbline::plant
