#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "app/base/config/page_token.h"
#include "app/plant/commands/plant_commands.h"
#include "app/plant/rights/rights.h"
#include "drivers/files/text_file.h"
#include "drivers/os/descriptor.h"

namespace plumbline::plant {
namespace {

struct CellOptions {
  std::string name, folder = "/etc/mosquitto/plumbline";
  std::string bridge;  ///< group of a line's broker, in place of a cell
  bool remove = false;
};

/// The user of the broker that the options name; nullopt after printing why there is none.
std::optional<std::string> BrokerUserOf(const CellOptions& options) {
  if (!options.bridge.empty()) {
    if (const auto valid = CheckGroup(options.bridge); !valid) {
      std::cerr << valid.error() << '\n';
      return std::nullopt;
    }
    return BridgeUserOf(options.bridge);
  }
  const auto cell = CellUserFrom(options.name);
  if (cell) return UserOf(*cell);
  std::cerr << cell.error() << '\n';
  return std::nullopt;
}

bool WriteBrokerFile(const std::string& path, const std::string& text) {
  const auto written = files::WriteTextFile(path, text);
  if (!written) std::cerr << fmt::format("{}: cannot be written: {}\n", path, written.error());
  return written.ok();
}

int ChangeCell(const CellOptions& options) {
  const auto user = BrokerUserOf(options);
  if (!user) return kExitUsage;
  // Two administrators at once must not overwrite each other's cell.
  const os::Descriptor folder(open(options.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0 || flock(folder.get(), LOCK_EX) != 0) {
    std::cerr << fmt::format("{}: {}; give the folder with --broker-folder\n", options.folder,
                             std::strerror(errno));
    return kExitUsage;
  }
  umask(S_IRWXO);  // the files of the broker are not for everybody
  const std::string passwords_file = options.folder + "/cells.passwd";
  std::string passwords;
  if (std::filesystem::exists(passwords_file)) {
    auto text = files::ReadTextFile(passwords_file);
    if (!text) {
      std::cerr << fmt::format("{}: {}\n", passwords_file, text.error());
      return kExitFault;
    }
    passwords = std::move(text).value();
  }
  const std::string password = config::GeneratedToken();
  if (options.remove) {
    const std::string without = WithoutUser(passwords, *user);
    if (without == passwords) {
      std::cerr << fmt::format("{} has no user {}\n", passwords_file, *user);
      return kExitFault;
    }
    passwords = without;
  } else {
    const auto line = PasswordLine(*user, password);
    if (!line) {
      std::cerr << line.error() << '\n';
      return kExitFault;
    }
    passwords = WithPasswordLine(passwords, *line);
  }
  const BrokerUsers users = UsersIn(passwords);
  if (!WriteBrokerFile(passwords_file, passwords) ||
      !WriteBrokerFile(options.folder + "/cells.acl", AclText(users.cells, users.bridged_groups))) {
    return kExitUsage;
  }
  if (!options.remove) std::cout << password << '\n';
  std::cerr << fmt::format(
      "{} {}; {} cells and {} bridges have access. Take effect: systemctl reload mosquitto\n",
      *user, options.remove ? "removed" : "added, with the password above", users.cells.size(),
      users.bridged_groups.size());
  return kExitOk;
}

void AddCellAction(CLI::App& parent, const char* name, const char* what, bool remove,
                   const char* footer, int& exit_code) {
  const auto options = std::make_shared<CellOptions>();
  options->remove = remove;
  CLI::App* const command = parent.add_subcommand(name, what);
  CLI::Option* const cell = command->add_option(
      "cell", options->name, "LINE/NODE, as in `group` and `node` of its [mqtt]");
  CLI::Option* const bridge = command->add_option("--bridge", options->bridge,
                                                  "Name of a line whose own broker is bridged");
  cell->excludes(bridge);
  command->add_option("--broker-folder", options->folder, "Folder of cells.passwd and cells.acl")
      ->capture_default_str();
  command->footer(footer);
  command->callback([options, &exit_code] { exit_code = ChangeCell(*options); });
}

}  // namespace

void AddCellCommand(CLI::App& app, int& exit_code) {
  CLI::App* const command =
      app.add_subcommand("cell", "Give a cell access to the broker, or take it away");
  command->require_subcommand(1);
  command->footer("Example:\n  plumbline plant cell add line-2/cell-7 > cell-7-password");
  AddCellAction(
      *command, "add", "Print a new password for a cell and let it write its topics", false,
      "The password file is the list of cells; the access list is written from it, so that\n"
      "each cell writes its own topics and reads nothing. A cell that has a password gets a\n"
      "new one.\n\n"
      "Run it on the broker's computer.\n\n"
      "Example:\n"
      "  plumbline plant cell add line-2/cell-7 > cell-7-password",
      exit_code);
  AddCellAction(*command, "remove", "Remove a cell's access", true,
                "Example:\n  plumbline plant cell remove line-2/cell-7", exit_code);
}

}  // namespace plumbline::plant
