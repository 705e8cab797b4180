#include "app/daemon/plc_side.h"

#include <fmt/format.h>

#include <tuple>

#include "app/log/log.h"
#include "app/version.h"

namespace plumbline {
namespace {

/// A serial line that was lost is tried again after pauses of up to 5 s.
constexpr double kTcpPatience_s = 2, kSerialPatience_s = 8;

void TellClient(const modbus::TcpServerEvent& event) {
  using Kind = modbus::TcpServerEvent::Kind;
  const char* text = event.kind == Kind::kStranger       ? "refused: not in plc.allow"
                     : event.kind == Kind::kNoRoom       ? "refused: every slot is kept"
                     : event.kind == Kind::kEvicted      ? "closed: longest idle, made room"
                     : event.kind == Kind::kFrameTimeout ? "closed: frame not completed in 1 s"
                     : event.kind == Kind::kNotReading   ? "closed: does not read its answers"
                     : event.kind == Kind::kBrokenFrame  ? "closed: not Modbus"
                                                         : "closed: out of file descriptors";
  const bool refused = event.kind == Kind::kStranger || event.kind == Kind::kNoRoom;
  Log({refused ? Event::kClientRefused : Event::kClientClosed,
       fmt::format("Modbus client {} {}", event.peer, text),
       {{"CLIENT", fmt::format("{}", event.peer)}}});
}

Result<std::unique_ptr<modbus::RtuSlave>> OpenLine(modbus::RtuSlaveOptions options,
                                                   modbus::ImageHandler& handler) {
  options.on_change = [device = options.device](const std::string& lost_because) {
    if (lost_because.empty()) {
      Log({Event::kSerialOpen, fmt::format("serial line {} open", device), {{"DEVICE", device}}});
    } else {
      Log({Event::kSerialLost,
           fmt::format("serial line {}: {}", device, lost_because),
           {{"DEVICE", device}}});
    }
  };
  return modbus::RtuSlave::Start(options, handler);
}

}  // namespace

Result<std::unique_ptr<PlcSide>> PlcSide::Open(const PlcConfig& config, int listen_fd,
                                               modbus::ImageHandler& handler) {
  auto side = std::make_unique<PlcSide>();
  modbus::TcpServerOptions tcp = config.tcp;
  tcp.listen_fd = listen_fd;
  tcp.on_event = TellClient;
  auto server = modbus::TcpServer::Start(tcp, handler);
  if (!server) return Error{server.error()};
  side->server_ = std::move(server).value();
  if (const int port = side->server_->port(); config.tcp.port != 0 && port != config.tcp.port) {
    Log({Event::kPlcPortDiffers,
         fmt::format("plc.port is {}, but the service manager's socket listens on {}, which is "
                     "served: set the same in both (systemctl edit plumbline.socket)",
                     config.tcp.port, port)});
  }
  if (config.rtu) {
    auto slave = OpenLine(*config.rtu, handler);
    if (!slave) return Error{slave.error()};
    side->slave_ = std::move(slave).value();
  }
  return side;
}

void PlcSide::AddTo(Lifeline& lifeline) const {
  lifeline.Add("Modbus TCP server", kTcpPatience_s,
               [server = server_.get()] { return server->pulse().beats(); });
  if (!slave_) return;
  lifeline.Add("Modbus serial line", kSerialPatience_s,
               [slave = slave_.get()] { return slave->pulse().beats(); });
}

modbus::DeviceIdentification Identification() {
  modbus::DeviceIdentification identification;
  identification.objects = {{0, "Plumbline"},
                            {1, "plumblined"},
                            {2, PLUMBLINE_VERSION},
                            {4, "Corrected assembly points"}};
  return identification;
}

bool PlcSideDiffers(const PlcConfig& a, const PlcConfig& b) {
  const auto tcp = [](const PlcConfig& config) {
    const modbus::TcpServerOptions& o = config.tcp;
    return std::tie(o.address, o.port, o.unit_id, o.max_clients, o.allow);
  };
  const auto line = [](const modbus::RtuSlaveOptions& o) {
    return std::tie(o.device, o.baud, o.stop_bits, o.parity);
  };
  if (tcp(a) != tcp(b) || a.rtu.has_value() != b.rtu.has_value()) return true;
  return a.rtu && line(*a.rtu) != line(*b.rtu);
}

}  // namespace plumbline
