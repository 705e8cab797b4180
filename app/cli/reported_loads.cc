#include "app/cli/reported_loads.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string_view>

#include "app/cell/journal/journal.h"
#include "drivers/plc/codec.h"
#include "drivers/robot/modbus_client.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::cli {
namespace {

constexpr double kReadTimeout_s = 0.3;
constexpr std::int64_t kMaxRows = 12000;         // as many as a diagnosis uses
constexpr std::uint16_t kPayloadKnown = 1 << 2;  // bit of input_validity

/// The current payload according to the daemon's registers.
std::optional<cell::ReportedLoad> LoadOfDaemon(const config::PlcConfig& plc) {
  if (plc.tcp.port == 0) return std::nullopt;
  auto client = robot::ModbusClient::Tcp(
      {config::IsWildcardAddress(plc.tcp.address) ? "127.0.0.1" : plc.tcp.address, plc.tcp.port},
      plc.tcp.unit_id, kReadTimeout_s, MonotonicSeconds);
  if (!client || client.value().Connect() != robot::LinkResult::kOk) return std::nullopt;
  std::array<std::uint16_t, 3> head{};
  std::array<std::uint16_t, plc::registers::kInputsSize> inputs{};
  const auto read = [&client](int first, std::span<std::uint16_t> words) {
    return client.value().Read(
               {robot::RegisterTable::kHolding, first, static_cast<int>(words.size())}, words) ==
           robot::LinkResult::kOk;
  };
  if (!read(0, head) || head[0] != plc::registers::kMagic ||
      !read(plc::registers::kInputs, inputs)) {
    return std::nullopt;
  }
  const auto value = [&](std::string_view name) {
    for (const plc::MapField& field : plc::registers::Fields()) {
      if (name != field.name) continue;
      return plc::ValueOfField(field.type, inputs, field.address - plc::registers::kInputs,
                               head[2] == 1);
    }
    return 0.0;
  };
  if ((static_cast<int>(value("input_validity")) & kPayloadKnown) == 0) return std::nullopt;
  return cell::ReportedLoad{value("payload"),
                            kMetrePerMm * Vec3(value("cog_x"), value("cog_y"), value("cog_z"))};
}

}  // namespace

std::vector<cell::ReportedLoad> LoadsReportedByRobot(const config::DaemonConfig& config) {
  std::vector<cell::ReportedLoad> loads;
  if (config.machine.payload.source != PayloadPolicy::Source::kRobot) return loads;
  if (const auto now = LoadOfDaemon(config.plc)) loads.push_back(*now);

  const std::string file = config.state_directory + "/journal.sqlite";
  std::error_code hidden;
  if (!std::filesystem::exists(file, hidden)) return loads;
  auto journal = cell::Journal::OpenForReading(file);
  if (!journal) return loads;
  std::optional<double> least, most;
  cell::JournalFilter filter;
  filter.last = kMaxRows;
  const auto read = journal.value().ForEach(
      filter, config.machine.cell.robot.joints, [&](const cell::JournalRow& row) {
        if (!row.payload_kg) return;
        least = std::min(least.value_or(*row.payload_kg), *row.payload_kg);
        most = std::max(most.value_or(*row.payload_kg), *row.payload_kg);
      });
  if (!read || !least) return loads;
  loads.push_back({*least, std::nullopt});
  loads.push_back({*most, std::nullopt});
  return loads;
}

}  // namespace plumbline::cli
