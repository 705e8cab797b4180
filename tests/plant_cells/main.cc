// plumbline-plant-cells: simulated cells that publish to a plant's broker, for tests, benchmarks
// and the demo.
#include <fmt/format.h>
#include <poll.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <vector>

#include "tests/plant_cells/cell_client.h"
#include "tests/plant_cells/recorded_cell.h"

using namespace plumbline::plant_cells;

namespace {

volatile std::sig_atomic_t stopped = 0;

double MonotonicNow_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::int64_t UtcNow_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

struct Options {
  BrokerAddress broker;
  int cells = 20;
  std::string line = "line", folder, report;
  int first = 1;
  double probe_s = 1, state_s = 1, seconds = 0, speed = 1, repeat_s = 0, start_days = 0;
};

/// A state or probe of a cell without a recording; the numbers only fill the rows.
std::string SyntheticBody(const Item& item, int cell) {
  const double phase = 0.01 * item.index + cell;
  if (std::string_view(item.type) == "NDATA") {
    return fmt::format(
        R"({{"status":3,"alarms":0,"warnings":0,"health":0,"health_reason":"ready","model":3,"data_age_ms":8,)"
        R"("q":[0.1,-90.2,{:.4f},1.4,30.5,-2.25],"payload_kg":60.0,"temp_C":{:.2f},"points":10,)"
        R"("points_valid":10,"monitoring":1,"loop":1,"probes":{},"drift_statistic":0.1203,)"
        R"("proposed_model":0,"cameras":[]}})",
        90 * std::sin(phase), 24 + std::sin(phase), item.index);
  }
  const double x = 1200 + 300 * std::sin(phase), dx = 0.05 * std::sin(7 * phase);
  return fmt::format(
      R"({{"journal":1790000000,"id":{},"source":"plc","session":"1","model":3,"measured_mm":)"
      R"([{:.4f},-400.02,900.3],"predicted_mm":[{:.4f},-400.0,900.0],"residual_mm":[{:.4f},-0.02,)"
      R"(0.3],"residual_size_mm":{:.4f},"payload_kg":60.0,"temp_C":21.5,"wild":false,"alarm":false,)"
      R"("quarantined":false,"q":[0.1,-90.2,{:.4f},1.4,30.5,-2.25]}})",
      item.index, x, x - dx, dx, std::hypot(dx, 0.02, 0.3), 90 * std::sin(phase));
}

struct Cell {
  std::unique_ptr<RecordedCell> recording;  ///< null: synthetic
  std::unique_ptr<CellClient> client;
  std::int32_t probes = 0, states = 0;
  std::size_t played = 0;  ///< items of the recording
};

std::vector<Cell> CellsOf(const Options& options) {
  std::vector<Cell> cells;
  std::vector<std::string> folders;
  if (!options.folder.empty()) {
    for (const auto& entry : std::filesystem::directory_iterator(options.folder)) {
      if (entry.is_directory()) folders.push_back(entry.path().string());
    }
    std::sort(folders.begin(), folders.end());
  }
  const std::size_t count =
      folders.empty() ? static_cast<std::size_t>(options.cells) : folders.size();
  for (std::size_t k = 0; k < count; ++k) {
    const int number = options.first + static_cast<int>(k);
    Cell cell;
    BodyOf body = [number](const Item& item) { return SyntheticBody(item, number); };
    std::string node = fmt::format("cell-{:03}", number);
    if (!folders.empty()) {
      cell.recording = std::make_unique<RecordedCell>(folders[k]);
      node = std::filesystem::path(folders[k]).filename().string();
      body = [recording = cell.recording.get()](const Item& item) { return recording->Body(item); };
    }
    cell.client = std::make_unique<CellClient>(options.broker, options.line, node,
                                               0xC0000000u + static_cast<std::uint32_t>(number),
                                               options.repeat_s, std::move(body));
    cells.push_back(std::move(cell));
  }
  return cells;
}

/// What is due at a time of the cells' clock.
void AddDue(Cell& cell, const Options& options, double elapsed_s, std::int64_t start_ms,
            std::int64_t utc_ms) {
  if (cell.recording) {
    for (; cell.played < cell.recording->items().size(); ++cell.played) {
      Item item = cell.recording->items()[cell.played];
      item.utc_ms += start_ms;
      if (item.utc_ms > utc_ms) return;
      cell.client->Add(item);
    }
    return;
  }
  const auto due = [&](double period_s) {
    return period_s > 0 ? static_cast<std::int32_t>(elapsed_s / period_s) : 0;
  };
  for (const std::int32_t end = due(options.state_s); cell.states < end; ++cell.states) {
    const auto at_ms = static_cast<std::int64_t>(1e3 * options.state_s * cell.states);
    cell.client->Add({start_ms + at_ms, "NDATA", cell.states});
  }
  for (const std::int32_t end = due(options.probe_s); cell.probes < end; ++cell.probes) {
    const auto at_ms = static_cast<std::int64_t>(1e3 * options.probe_s * cell.probes) + 1;
    cell.client->Add({start_ms + at_ms, "NPROBE", cell.probes});
  }
}

void WriteReport(const std::string& file, const std::vector<Cell>& cells) {
  if (file.empty()) return;
  std::ofstream out(file + ".new");
  for (const Cell& cell : cells) {
    out << fmt::format(
        R"({{"line":"{}","node":"{}","stream":{},"messages":{},"probes":{},"unacknowledged":{},"sent":{}}})"
        "\n",
        cell.client->line(), cell.client->node(), cell.client->stream(), cell.client->last_seq(),
        cell.probes, cell.client->unacknowledged(), cell.client->sent());
  }
  out.close();
  std::filesystem::rename(file + ".new", file);
}

int RunCells(const Options& options) {
  mosquitto_lib_init();
  std::vector<Cell> cells = CellsOf(options);
  const double begin_s = MonotonicNow_s();
  const std::int64_t start_ms =
      UtcNow_ms() - static_cast<std::int64_t>(86'400'000 * options.start_days);
  double reported_s = begin_s;
  for (;;) {
    const double now_s = MonotonicNow_s();
    double elapsed_s = options.speed * (now_s - begin_s);
    if (!options.folder.empty()) elapsed_s += 86400 * options.start_days;  // recorded until now
    if (options.seconds > 0) elapsed_s = std::min(elapsed_s, options.seconds);
    const auto utc_ms = start_ms + static_cast<std::int64_t>(1e3 * elapsed_s);
    std::size_t left = 0;
    std::vector<pollfd> waiting;
    for (Cell& cell : cells) {
      AddDue(cell, options, elapsed_s, start_ms, utc_ms);
      cell.client->Work(now_s, UtcNow_ms());
      left += cell.client->unacknowledged();
      if (cell.client->descriptor() >= 0) {
        waiting.push_back(
            {cell.client->descriptor(),
             static_cast<short>(cell.client->wants_write() ? POLLIN | POLLOUT : POLLIN), 0});
      }
    }
    const bool all_made = options.seconds > 0 && elapsed_s >= options.seconds;
    if (now_s - reported_s > 0.5 || (all_made && left == 0)) {
      WriteReport(options.report, cells);
      reported_s = now_s;
    }
    if (stopped != 0 || (all_made && left == 0 && options.repeat_s == 0)) break;
    poll(waiting.data(), waiting.size(), 2);
  }
  for (Cell& cell : cells) cell.client->Disconnect();
  WriteReport(options.report, cells);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGTERM, [](int) { stopped = 1; });
  std::signal(SIGINT, [](int) { stopped = 1; });
  CLI::App app("Simulated cells of a plant");
  Options options;
  app.add_option("--port", options.broker.port, "of the broker on this machine")->required();
  app.add_option("--cells", options.cells, "number of synthetic cells");
  app.add_option("--first", options.first, "number of the first");
  app.add_option("--line", options.line, "second level of their topics");
  app.add_option("--folder", options.folder,
                 "of recorded cells: a folder each, see recorded_cell.h");
  app.add_option("--probe-s", options.probe_s, "interval of probes, 0: none");
  app.add_option("--state-s", options.state_s, "interval of states, 0: none");
  app.add_option("--seconds", options.seconds, "of the cells' time; 0: until a signal");
  app.add_option("--speed", options.speed, "seconds of the cells' time in a second");
  app.add_option("--start-days", options.start_days, "the cells' time starts so long ago");
  app.add_option("--repeat-s", options.repeat_s,
                 "acknowledged messages are repeated so long at a new connection; then it runs "
                 "until a signal");
  app.add_option("--report", options.report,
                 "file with what was published, renewed twice a second");
  CLI11_PARSE(app, argc, argv);
  return RunCells(options);
}
