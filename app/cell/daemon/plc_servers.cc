#include "app/cell/daemon/plc_servers.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "app/base/log/log.h"
#include "app/base/service/signals.h"
#include "app/cell/daemon/device_wait.h"
#include "app/version.h"

namespace plumbline::cell {
namespace {

constexpr double kPlcTimeout_s = 2;
/// File descriptors reserved for the robot link, the journal, cameras and everything else the
/// daemon opens. Clients may use the others, two each (one of them deposited with the service
/// manager). With 256 clients at most all descriptors stay below 1024, the limit of select(), which
/// libmodbus uses for the robot.
constexpr int kReservedDescriptors = 40, kDescriptorsPerClient = 2;
constexpr char kListener[] = "modbus";  // FileDescriptorName= of plumbline.socket
constexpr char kConnection[] = "modbus-client";

void LogClientEvent(const modbus::TcpServerEvent& event) {
  using Kind = modbus::TcpServerEvent::Kind;
  if (event.kind == Kind::kOtherUnit) {
    log::Log({log::Event::kClientRefused,
              fmt::format("Modbus client {} asks for unit id {}, which is answered with exception "
                          "11: set unit id 1 in the client, or unit_id = {} under [plc]",
                          event.peer, event.unit_id, event.unit_id),
              {{"CLIENT", fmt::format("{}", event.peer)}}});
    return;
  }
  const char* text = event.kind == Kind::kNotAllowed     ? "refused: not in plc.allow"
                     : event.kind == Kind::kNoFreeSlot   ? "refused: every slot is reserved"
                     : event.kind == Kind::kEvicted      ? "closed: longest idle, to make room"
                     : event.kind == Kind::kFrameTimeout ? "closed: frame not completed within 1 s"
                     : event.kind == Kind::kNotReading   ? "closed: does not read its answers"
                     : event.kind == Kind::kBrokenFrame  ? "closed: not Modbus"
                                                         : "closed: out of file descriptors";
  const bool refused = event.kind == Kind::kNotAllowed || event.kind == Kind::kNoFreeSlot;
  log::Log({refused ? log::Event::kClientRefused : log::Event::kClientClosed,
            fmt::format("Modbus client {} {}", event.peer, text),
            {{"CLIENT", fmt::format("{}", event.peer)}}});
}

void LogTwoMasters(const modbus::Client& writer, const modbus::Client& other) {
  log::Log(
      {log::Event::kTwoMasters,
       fmt::format("two masters: {} and {} write the command window (registers {}-{}). Each "
                   "may overwrite the other's command or read its answer. Let only one of them "
                   "write commands: list it in plc.allow, or set the other to read only",
                   modbus::TextOf(writer), modbus::TextOf(other), plc::registers::kCommands,
                   plc::registers::kCommands + plc::registers::kCommandsSize - 1),
       {{"CLIENT", modbus::TextOf(writer)}, {"OTHER_CLIENT", modbus::TextOf(other)}}});
}

Result<std::unique_ptr<modbus::RtuSlave>> OpenSerialLine(modbus::RtuSlaveOptions options,
                                                         modbus::ImageHandler& handler) {
  options.on_change = [device = options.device](const std::string& lost_because) {
    if (lost_because.empty()) {
      log::Log({log::Event::kSerialOpen,
                fmt::format("serial line {} open", device),
                {{"DEVICE", device}}});
    } else {
      log::Log({log::Event::kSerialLost,
                fmt::format("serial line {}: {}", device, lost_because),
                {{"DEVICE", device}}});
    }
  };
  return modbus::RtuSlave::Start(options, handler);
}

/// Logs settings that have no effect because the service manager owns the listening socket.
/// @param at         where the server listens
/// @param inherited  whether the service manager provided the socket
void LogEndpointMismatch(const modbus::TcpServerOptions& asked, const os::TcpEndpoint& at,
                         bool inherited) {
  const auto log = [](const std::string& key, const std::string& wanted,
                      const std::string& actual) {
    log::Log(
        {log::Event::kPlcPortDiffers,
         fmt::format("plc.{} is {}, but the service manager's socket listens on {}, which "
                     "takes precedence. Set the same in both (systemctl edit plumbline.socket)",
                     key, wanted, actual)});
  };
  if (asked.port != 0 && at.port != asked.port) {
    log("port", fmt::format("{}", asked.port), fmt::format("{}", at.port));
  }
  const bool any_address = config::IsWildcardAddress(at.address);
  if (!inherited || at.address == asked.address ||
      (any_address && config::IsWildcardAddress(asked.address)))
    return;
  log("listen", asked.address, any_address ? "every address" : at.address);
}

/// The number of clients that leaves enough descriptors for the rest of the daemon.
int LimitClients(int wanted) {
  const int needed = kReservedDescriptors + kDescriptorsPerClient * wanted;
  const int limit = service::RaiseDescriptorLimit(needed);
  if (limit >= needed) return wanted;
  const int served = std::max(1, (limit - kReservedDescriptors) / kDescriptorsPerClient);
  log::Log(
      {log::Event::kFileWarning,
       fmt::format("plc.max_clients: warning: {} clients need {} open files, but this process may "
                   "have only {}: {} are served. Raise LimitNOFILE of the service (ulimit -n)",
                   wanted, needed, limit, served)});
  return served;
}

}  // namespace

Result<std::unique_ptr<PlcServers>> PlcServers::Open(const config::PlcConfig& config,
                                                     service::ServiceManager& manager,
                                                     modbus::ImageHandler& handler) {
  auto servers = std::make_unique<PlcServers>();
  modbus::TcpServerOptions tcp = config.tcp;
  tcp.max_clients = LimitClients(tcp.max_clients);
  tcp.offers_connections = manager.available();
  tcp.on_event = LogClientEvent;
  handler.ReportTwoMasters(LogTwoMasters);
  modbus::InheritedSockets inherited{manager.TakeSocket(kListener),
                                     manager.TakeSockets(kConnection)};
  const bool listener_inherited = static_cast<bool>(inherited.listener);
  auto server = modbus::TcpServer::Start(tcp, handler, std::move(inherited));
  if (!server) return server.failure();
  servers->server_ = std::move(server).value();
  LogEndpointMismatch(tcp, servers->server_->endpoint(), listener_inherited);
  if (config.rtu) {
    auto slave = OpenSerialLine(*config.rtu, handler);
    if (!slave) return slave.failure();
    servers->slave_ = std::move(slave).value();
  }
  return servers;
}

void PlcServers::DepositConnections(const service::ServiceManager& manager) {
  manager.StoreDescriptors(kConnection, server_->TakeOffered());
}

void PlcServers::AddTo(ThreadWatchdog& watchdog) const {
  watchdog.Add("Modbus TCP server", kPlcTimeout_s,
               [server = server_.get()] { return server->heartbeat().beats(); });
  if (!slave_) return;
  watchdog.Add(
      "Modbus serial line", kPlcTimeout_s,
      [slave = slave_.get()] { return slave->heartbeat().beats(); },
      [slave = slave_.get()] { return IsWaitingForDevice(slave->heartbeat().thread()); });
}

modbus::DeviceIdentification Identification() {
  modbus::DeviceIdentification identification;
  identification.objects = {{0, "Plumbline"},
                            {1, "plumblined"},
                            {2, PLUMBLINE_VERSION},
                            {4, "Corrected assembly points"}};
  return identification;
}

bool PlcServersDiffer(const config::PlcConfig& a, const config::PlcConfig& b) {
  const auto tcp = [](const config::PlcConfig& config) {
    const modbus::TcpServerOptions& o = config.tcp;
    return std::tie(o.address, o.port, o.unit_id, o.max_clients, o.allow);
  };
  const auto line = [](const modbus::RtuSlaveOptions& o) {
    return std::tie(o.device, o.baud, o.stop_bits, o.parity);
  };
  if (tcp(a) != tcp(b) || a.rtu.has_value() != b.rtu.has_value()) return true;
  return a.rtu && line(*a.rtu) != line(*b.rtu);
}

}  // namespace plumbline::cell
