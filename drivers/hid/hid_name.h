// Name of a HID device: USB ids and serial number.
#pragma once

#include <string>

namespace plumbline::hid {

inline constexpr int kMaxReportBytes = 64;  ///< full-speed USB, including the report id

struct HidName {
  int vendor_id = 0, product_id = 0;
  std::string serial;  ///< selects one of several equal devices; empty: any

  bool operator==(const HidName&) const = default;
};

}  // namespace plumbline::hid
