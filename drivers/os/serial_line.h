// Settings of a serial line, and their application to an open device.
#pragma once

#include <string>

namespace plumbline::os {

struct SerialSettings {
  int baud = 9600;    ///< a standard rate from 1200 to 115200
  int data_bits = 8;  ///< 7 or 8
  char parity = 'N';  ///< 'N', 'E' or 'O'
  int stop_bits = 1;  ///< 1 or 2

  bool operator==(const SerialSettings&) const = default;
};

/// What is wrong with the settings: "baud 100 is not one of 1200, 2400, ..."; empty if nothing.
std::string FaultOf(const SerialSettings& settings);

/// "9600 8N1".
std::string SerialSettingsText(const SerialSettings& settings);

/// Makes the line raw, without flow control and modem lines, and discards what it has received. A
/// byte with a parity error is read as 0.
/// @param settings  without fault
/// @return          false with errno set
bool ConfigureSerialLine(int fd, const SerialSettings& settings);

}  // namespace plumbline::os
