#include "drivers/os/serial_line.h"

#include <fmt/format.h>
#include <termios.h>

#include <algorithm>
#include <iterator>

namespace plumbline::os {
namespace {

struct BaudRate {
  int baud;
  speed_t code;
};
constexpr BaudRate kBaudRates[] = {{1200, B1200},   {2400, B2400},    {4800, B4800},
                                   {9600, B9600},   {19200, B19200},  {38400, B38400},
                                   {57600, B57600}, {115200, B115200}};

const BaudRate* FindBaudRate(int baud) {
  const auto* found = std::find_if(std::begin(kBaudRates), std::end(kBaudRates),
                                   [baud](const BaudRate& rate) { return rate.baud == baud; });
  return found == std::end(kBaudRates) ? nullptr : found;
}

}  // namespace

std::string FaultOf(const SerialSettings& settings) {
  if (FindBaudRate(settings.baud) == nullptr) {
    std::string rates;
    for (const BaudRate& rate : kBaudRates) {
      rates += (rates.empty() ? "" : ", ") + std::to_string(rate.baud);
    }
    return fmt::format("baud {} is not one of {}", settings.baud, rates);
  }
  if (settings.data_bits != 7 && settings.data_bits != 8) {
    return fmt::format("{} data bits: only 7 or 8 are possible", settings.data_bits);
  }
  if (settings.parity != 'N' && settings.parity != 'E' && settings.parity != 'O') {
    return fmt::format("parity \"{}\" is not one of N, E, O", settings.parity);
  }
  if (settings.stop_bits != 1 && settings.stop_bits != 2) {
    return fmt::format("stop bits {} is not 1 or 2", settings.stop_bits);
  }
  return {};
}

std::string SerialSettingsText(const SerialSettings& settings) {
  return fmt::format("{} {}{}{}", settings.baud, settings.data_bits, settings.parity,
                     settings.stop_bits);
}

bool ConfigureSerialLine(int fd, const SerialSettings& settings) {
  termios line{};
  if (tcgetattr(fd, &line) != 0) return false;
  cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  line.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB | PARODD | CSIZE);
  line.c_cflag |= settings.data_bits == 7 ? CS7 : CS8;
  if (settings.stop_bits == 2) line.c_cflag |= CSTOPB;
  if (settings.parity != 'N') line.c_cflag |= PARENB;
  if (settings.parity == 'O') line.c_cflag |= PARODD;
  if (settings.parity != 'N') line.c_iflag |= INPCK;
  cfsetspeed(&line, FindBaudRate(settings.baud)->code);
  return tcsetattr(fd, TCSANOW, &line) == 0 && tcflush(fd, TCIOFLUSH) == 0;
}

}  // namespace plumbline::os
