#include "app/cli/status_command.h"

#include <fmt/format.h>
#include <modbus/modbus.h>

#include <cerrno>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "app/cli/exit_codes.h"
#include "drivers/plc/codec.h"
#include "firmware-like/result.h"

namespace plumbline {
namespace {

struct Options {
  std::string host = "127.0.0.1";
  int port = 502;
  bool json = false;
};

/// Registers of a running daemon.
class DaemonRegisters {
 public:
  static Result<DaemonRegisters> Read(const Options& options) {
    const std::unique_ptr<modbus_t, decltype(&modbus_free)> link(
        modbus_new_tcp_pi(options.host.c_str(), std::to_string(options.port).c_str()),
        &modbus_free);
    if (!link || modbus_connect(link.get()) != 0) {
      return Error{
          fmt::format("{}:{}: {}; is plumblined running, and is this its plc.listen and plc.port?",
                      options.host, options.port, modbus_strerror(errno))};
    }
    DaemonRegisters daemon;
    const auto read = [&](int first, int count) {
      daemon.registers_.resize(static_cast<std::size_t>(first) + static_cast<std::size_t>(count));
      return modbus_read_registers(link.get(), first, count, daemon.registers_.data() + first) ==
             count;
    };
    bool ok = read(0, plc_map::kStateSize);
    if (ok && daemon.registers_[0] != plc_map::kMagic) {
      return Error{
          fmt::format("{}:{} answers Modbus, but is no plumblined", options.host, options.port)};
    }
    ok = ok && read(plc_map::kInputs, plc_map::kInputsSize);
    for (int k = 0; ok && k < daemon.points(); ++k) {
      ok = read(plc_map::kPoints + plc_map::kPointSize * k, plc_map::kPointSize);
    }
    modbus_close(link.get());
    if (!ok) {
      return Error{fmt::format("{}:{}: {}", options.host, options.port, modbus_strerror(errno))};
    }
    return daemon;
  }

  int points() const { return registers_[20]; }
  double Value(std::string_view name) const { return Find(plc_map::Fields(), name, 0); }
  double Value(std::string_view name, int point) const {
    return Find(plc_map::PointFields(), name, plc_map::kPoints + plc_map::kPointSize * point);
  }
  int Word(std::string_view name) const { return static_cast<int>(Value(name)); }
  bool Status(int bit) const { return (Word("status") & bit) != 0; }

 private:
  double Find(std::span<const MapField> fields, std::string_view name, int base) const {
    for (const MapField& field : fields) {
      if (name == field.name) {
        return ValueOfField(field.type, registers_, static_cast<std::size_t>(base) + field.address,
                            registers_[2] == 1);
      }
    }
    assert(false && "no such field");
    return 0;
  }

  std::vector<std::uint16_t> registers_;
};

nlohmann::json AsJson(const DaemonRegisters& daemon) {
  nlohmann::json json;
  for (const MapField& field : plc_map::Fields()) {
    const bool result = field.address >= plc_map::kResult && field.address < plc_map::kInputs;
    if (!result) json[field.name] = daemon.Value(field.name);
  }
  json["points_detail"] = nlohmann::json::array();
  for (int k = 0; k < daemon.points(); ++k) {
    nlohmann::json point;
    for (const MapField& field : plc_map::PointFields()) {
      point[field.name] = daemon.Value(field.name, k);
    }
    json["points_detail"].push_back(point);
  }
  return json;
}

void Print(const DaemonRegisters& daemon) {
  const auto line = [](const char* topic, const std::string& text) {
    std::cout << fmt::format("{:<12} {}\n", topic, text);
  };
  const int firmware = daemon.Word("firmware");
  line("daemon",
       fmt::format("version {}.{}.{}, up {:.0f} s, start number {}, {} Modbus clients",
                   firmware / 10000, firmware / 100 % 100, firmware % 100, daemon.Value("uptime"),
                   daemon.Word("boot_counter"), daemon.Word("clients")));
  line("cycle", fmt::format("{:.1f} ms, longest computation {:.2f} ms, {} late",
                            0.1 * daemon.Value("cycle_period"),
                            1e-3 * daemon.Value("longest_cycle"), daemon.Word("overruns")));
  const auto fault = static_cast<InputFault>(daemon.Word("input_fault"));
  const int age_ms = daemon.Word("data_age");
  line("robot", fault == InputFault::kOk ? fmt::format("trusted, {} ms old", age_ms)
                                         : fmt::format("NOT trusted: {}", Describe(fault)));
  std::string joints;
  for (int k = 1; k <= daemon.Word("joints"); ++k) {
    joints += fmt::format(" {:.3f}", daemon.Value(fmt::format("q{}", k)));
  }
  line("joints", joints.empty() ? "none" : joints.substr(1) + " deg");
  if (const double radius_mm = daemon.Value("reading_radius"); radius_mm > 0) {
    line("",
         fmt::format("steps of the joint registers cost {:.2f} mm at the tip (95 %)", radius_mm));
  }
  line("payload", daemon.Status(status::kPayloadValid)
                      ? fmt::format("{:.2f} kg", daemon.Value("payload"))
                      : "not known");
  line("alarms",
       daemon.Word("alarms") == 0 ? "none" : fmt::format("0x{:04X}", daemon.Word("alarms")));
  line("warnings",
       daemon.Word("warnings") == 0 ? "none" : fmt::format("0x{:04X}", daemon.Word("warnings")));
  for (int k = 0; k < daemon.points(); ++k) {
    const auto value = [&](const char* name) { return daemon.Value(name, k); };
    const auto code = static_cast<CorrectionCode>(value("point_code"));
    const bool valid = (static_cast<int>(value("point_validity")) & plc_map::kValid) != 0;
    line("point",
         fmt::format("{:<5} {}", value("point_id"),
                     valid ? fmt::format("x {:.3f}  y {:.3f}  z {:.3f} mm, corrected by "
                                         "{:.3f} mm, 95 % within {:.3f} mm",
                                         value("point_x"), value("point_y"), value("point_z"),
                                         value("point_correction"), value("point_uncertainty"))
                           : std::string("no correction: ") + Describe(code)));
  }
}

int Run(const Options& options) {
  const Result<DaemonRegisters> daemon = DaemonRegisters::Read(options);
  if (!daemon) {
    std::cerr << daemon.error() << '\n';
    return kExitUsage;
  }
  if (options.json) {
    std::cout << AsJson(*daemon).dump(1) << '\n';
  } else {
    Print(*daemon);
  }
  return daemon->Status(status::kError) ? kExitFault : kExitOk;
}

}  // namespace

void AddStatusCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("status", "What a running daemon says of itself");
  command->add_option("--host", options->host, "The daemon's address")->capture_default_str();
  command->add_option("--port", options->port, "Its plc.port")
      ->capture_default_str()
      ->check(CLI::Range(1, 65535));
  command->add_flag("--json", options->json, "For programs");
  command->footer(
      "Reads the PLC's registers over Modbus TCP; `plumbline registers` explains them.\n\n"
      "Example:\n  plumbline status --port 1502\n\n"
      "Exit codes: 0 no alarm, 1 an alarm stands, 2 no daemon there.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline
