#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <iostream>

#include "app/base/service/service_manager.h"
#include "app/base/service/signals.h"
#include "app/plant/commands/plant_commands.h"
#include "app/plant/page/plant_page.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/port_file.h"

namespace plumbline::plant {
namespace {

struct PageCommandOptions : DatabaseOptions {
  std::string listen, port_file;
};

/// "127.0.0.1:8090", "[::1]:8090". @return  false for any other text
bool ReadAddress(const std::string& text, config::PageConfig& page) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || text.size() - colon > 6) return false;
  const std::string port = text.substr(colon + 1);
  if (port.empty() || port.find_first_not_of("0123456789") != std::string::npos) return false;
  page.listen = text.substr(0, colon);
  if (page.listen.starts_with('[') && page.listen.ends_with(']')) {
    page.listen = page.listen.substr(1, page.listen.size() - 2);
  }
  page.port = std::stoi(port);
  return *page.port <= 65535;
}

int ServePage(const PageCommandOptions& options) {
  service::ServiceManager manager;
  const os::Descriptor signals(service::OpenSignalDescriptor());
  auto config = PlantConfigOf(options);
  if (!config) return kExitFault;
  config::PageConfig& page = config->page;
  if (!options.listen.empty() && !ReadAddress(options.listen, page)) {
    std::cerr << fmt::format("--listen {}: not ADDRESS:PORT, as in 127.0.0.1:8090\n",
                             options.listen);
    return kExitUsage;
  }
  if (!page.port) page.port = kPlantPagePort;
  const auto log = [](const std::string& line) { std::cerr << line + "\n"; };
  bool faulty = false;
  auto started = PlantPage::Start({page, config->database.connection, log},
                                  manager.TakeSocket("http"), &faulty);
  if (!started) {
    std::cerr << fmt::format("the page is not served: {}\n", started.error());
    return faulty ? kExitFault : kExitUsage;  // its unit is not restarted after a fault
  }
  const os::TcpEndpoint at = (*started)->at();
  if (!options.port_file.empty()) {
    if (const auto written = os::WritePortFile(options.port_file, {{"page", at.port}}); !written) {
      std::cerr << written.error() << '\n';
      return kExitUsage;
    }
  }
  const std::string serving = fmt::format("the plant's page is at http://{}/", at.Text());
  log(serving);
  manager.Ready(serving);
  pollfd waiting{signals.get(), POLLIN, 0};
  // A terminal that closes sends SIGHUP; there is nothing to reload.
  for (signalfd_siginfo info{};;) {
    if (poll(&waiting, 1, -1) > 0 && read(signals.get(), &info, sizeof info) == sizeof info &&
        info.ssi_signo != SIGHUP) {
      break;
    }
  }
  manager.Stopping();
  return kExitOk;
}

}  // namespace

void AddPageCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<PageCommandOptions>();
  CLI::App* const command =
      app.add_subcommand("page", "Serve the wall of all cells to browsers, until SIGTERM");
  AddDatabaseOptions(*command, *options);
  command->add_option(
      "--listen", options->listen,
      fmt::format("ADDRESS:PORT instead of those of [page]; default 127.0.0.1:{}", kPlantPagePort));
  command->add_option("--port-file", options->port_file,
                      "Write \"page PORT\" into this file, for scripts that give port 0");
  command->footer(
      "An address that other computers reach needs a token under [page] of plant.toml, as a cell's "
      "page does. The page changes nothing. Needs the role plumbline_reader.\n\n"
      "Example:\n"
      "  plumbline plant page --database \"host=db1 dbname=plumbline user=reader\"\n\n"
      "Exit codes: 0 stopped by SIGTERM or SIGINT; 1 faults in the configuration, as an exposed "
      "address without a token; 2 wrong arguments, or the page cannot be served. SIGHUP is "
      "ignored.");
  command->callback([options, &exit_code] { exit_code = ServePage(*options); });
}

}  // namespace plumbline::plant
