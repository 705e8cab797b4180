#include "app/daemon/plc_side.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "app/daemon/device_wait.h"
#include "app/log/log.h"
#include "app/service/descriptors.h"
#include "app/version.h"

namespace plumbline {
namespace {

constexpr double kPlcPatience_s = 2;
/// Files and sockets kept for the robot's link, the journal, cameras and what else the daemon
/// opens: clients may take the others, two for each (one of them for the service manager to keep).
/// All stay below 1024 (256 clients at most), which select() of libmodbus, the robot's, cannot go
/// beyond.
constexpr int kKeptDescriptors = 40, kDescriptorsOfClient = 2;
constexpr char kListener[] = "modbus";  // FileDescriptorName= of plumbline.socket
constexpr char kConnection[] = "modbus-client";

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

void TellTwoMasters(const modbus::Client& writer, const modbus::Client& other) {
  Log({Event::kTwoMasters,
       fmt::format("two masters: {} and {} write the command window (registers {}-{}). Each "
                   "may overwrite the other's command or read its answer. Let one of them command: "
                   "name it in plc.allow, or set the other to read only",
                   TextOf(writer), TextOf(other), plc_map::kCommands,
                   plc_map::kCommands + plc_map::kCommandsSize - 1),
       {{"CLIENT", TextOf(writer)}, {"OTHER_CLIENT", TextOf(other)}}});
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

/// What the configuration asks for does not hold where the service manager has the socket.
/// @param at         where the server listens
/// @param inherited  by the service manager's socket
void TellWhereItDiffers(const modbus::TcpServerOptions& asked, const TcpEndpoint& at,
                        bool inherited) {
  const auto tell = [](const std::string& key, const std::string& wanted, const std::string& is) {
    Log({Event::kPlcPortDiffers,
         fmt::format("plc.{} is {}, but the service manager's socket listens on {}, which is "
                     "served: set the same in both (systemctl edit plumbline.socket)",
                     key, wanted, is)});
  };
  if (asked.port != 0 && at.port != asked.port) {
    tell("port", fmt::format("{}", asked.port), fmt::format("{}", at.port));
  }
  const bool every = IsEveryAddress(at.address);
  if (!inherited || at.address == asked.address || (every && IsEveryAddress(asked.address))) return;
  tell("listen", asked.address, every ? "every address" : at.address);
}

/// As many clients as leave descriptors for the rest of the daemon.
int ClientsThatFit(int wanted) {
  const int needed = kKeptDescriptors + kDescriptorsOfClient * wanted;
  const int limit = RaiseDescriptorLimit(needed);
  if (limit >= needed) return wanted;
  const int served = std::max(1, (limit - kKeptDescriptors) / kDescriptorsOfClient);
  Log({Event::kFileWarning,
       fmt::format("plc.max_clients: warning: {} clients need {} open files, and this process may "
                   "have {}: {} are served; raise LimitNOFILE of the service (ulimit -n)",
                   wanted, needed, limit, served)});
  return served;
}

}  // namespace

Result<std::unique_ptr<PlcSide>> PlcSide::Open(const PlcConfig& config, ServiceManager& manager,
                                               modbus::ImageHandler& handler) {
  auto side = std::make_unique<PlcSide>();
  modbus::TcpServerOptions tcp = config.tcp;
  tcp.max_clients = ClientsThatFit(tcp.max_clients);
  tcp.offers_connections = manager.available();
  tcp.on_event = TellClient;
  handler.ReportTwoMasters(TellTwoMasters);
  modbus::InheritedSockets inherited{manager.TakeSocket(kListener),
                                     manager.TakeSockets(kConnection)};
  const bool listener_inherited = static_cast<bool>(inherited.listener);
  auto server = modbus::TcpServer::Start(tcp, handler, std::move(inherited));
  if (!server) return server.failure();
  side->server_ = std::move(server).value();
  TellWhereItDiffers(tcp, side->server_->endpoint(), listener_inherited);
  if (config.rtu) {
    auto slave = OpenLine(*config.rtu, handler);
    if (!slave) return slave.failure();
    side->slave_ = std::move(slave).value();
  }
  return side;
}

void PlcSide::KeepConnections(const ServiceManager& manager) {
  manager.StoreDescriptors(kConnection, server_->TakeOffered());
}

void PlcSide::AddTo(Lifeline& lifeline) const {
  lifeline.Add("Modbus TCP server", kPlcPatience_s,
               [server = server_.get()] { return server->pulse().beats(); });
  if (!slave_) return;
  lifeline.Add(
      "Modbus serial line", kPlcPatience_s,
      [slave = slave_.get()] { return slave->pulse().beats(); },
      [slave = slave_.get()] { return WaitsForDevice(slave->pulse().thread()); });
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
