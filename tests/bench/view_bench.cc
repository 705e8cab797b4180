// End-to-end benchmark of the display: the real daemon with recorded cameras, and the viewer in a
// separate process with a fake 60 Hz card. Latency from a camera frame to its flip, memory of all
// processes, and the effect of drawing on the control cycle. Everything runs on two CPU cores.
#include <sched.h>
#include <sys/signalfd.h>

#include <cstring>

#include "app/display/view_process/view_loop.h"
#include "tests/bench/rows.h"
#include "tests/bench/view_station.h"
#include "tests/drivers/display/fake_card.h"

using namespace plumbline;
using namespace plumbline::bench;

namespace {

constexpr double kRefresh_Hz = 60;
constexpr int kUnitsNice = 10;  ///< systemd/plumbline-view.service

/// Runs the viewer like plumbline-view, on a fake card in this process. Prints the times of each
/// shown frame when it ends.
int RunViewer(const std::string& config_file) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  display::ConfigureMalloc();
  const int ended = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  test::FakeCard card;
  card.modes = {{1920, 1080}};
  std::ifstream given(config_file);
  std::string text{std::istreambuf_iterator<char>(given), {}};
  const std::string mine = config_file + ".view";
  std::ofstream(mine) << text.replace(text.find(kCard), kCard.size(), card.path);

  display::DisplayMailbox shown;
  std::optional<ShownFrame> committed;  // since frame_s
  double frame_s = 0;
  std::uint64_t sequence = 0;
  const display::ViewLoop* drawing = nullptr;
  card.on_commit = [&] {
    committed.reset();
    if (drawing == nullptr || drawing->state().cameras.empty()) return;
    const cell::ViewState& state = drawing->state();
    const auto& image = state.cameras.front().image;
    if (!image || image->sequence == sequence) return;
    sequence = image->sequence;
    frame_s = image->time_s;
    committed = {1e3 * (state.now_s - frame_s), 1e3 * (drawing->drawing_started_s() - frame_s),
                 1e3 * (MonotonicSeconds() - frame_s), 0};
  };
  std::vector<ShownFrame> frames;
  card.on_flip = [&] {
    if (!committed) return;
    committed->flipped = 1e3 * (MonotonicSeconds() - frame_s);
    frames.push_back(*std::exchange(committed, std::nullopt));
  };
  std::atomic<bool> stop{false};
  std::thread screen([&] {
    for (double next_s = MonotonicSeconds(); !stop; next_s += 1 / kRefresh_Hz) {
      SleepSeconds(std::max(0.0, next_s - MonotonicSeconds()));
      card.Refresh();
    }
  });
  config::FaultList faults;
  auto model = cell::ReadViewModel(mine, 0, faults);
  if (!model) fmt::print(stderr, "{}", config::FaultsText(faults));
  if (model) {
    display::ViewLoop loop(mine, std::move(*model), shown);
    drawing = &loop;
    signalfd_siginfo info{};
    while (read(ended, &info, sizeof info) != sizeof info) loop.RunOnce();
  }
  stop = true;
  screen.join();
  for (const ShownFrame& one : frames) {
    fmt::print("{:.3f} {:.3f} {:.3f} {:.3f}\n", one.received, one.begun, one.committed,
               one.flipped);
  }
  return 0;
}

/// Quantile of the start lateness between two readings of the counters [ms].
double QuantileBetween(const LatenessHistogram& from, const LatenessHistogram& to,
                       double fraction) {
  std::array<double, LatenessHistogram::kClasses> count{};
  double all = 0;
  for (std::size_t k = 0; k < count.size(); ++k) {
    all += count[k] = static_cast<double>(to.counts[k] - from.counts[k]);
  }
  double remaining = fraction * all, low_s = 0;
  for (std::size_t k = 0; k < LatenessHistogram::kBounds_s.size(); ++k) {
    const double high_s = LatenessHistogram::kBounds_s[k];
    if (count[k] > 0 && remaining <= count[k]) {
      return 1e3 * (low_s + remaining / count[k] * (high_s - low_s));
    }
    remaining -= count[k];
    low_s = high_s;
  }
  return 1e3 * low_s;
}

double StartP99_ms(const ViewStation& station, double seconds) {
  const LatenessHistogram from = station.Starts();
  SleepSeconds(seconds);
  return QuantileBetween(from, station.Starts(), 0.99);
}

/// Latency from a frame to its flip, and its contributions.
void MeasureFlips(const std::string& folder, const char* program, int cameras, double run_s) {
  const ViewStation station(folder, program, cameras);
  os::ChildProcess viewer = station.StartViewer(0);
  SleepSeconds(run_s);
  const std::vector<ShownFrame> shown = station.EndViewer(viewer);
  if (shown.size() < 20) {
    ReportSkipped(fmt::format("frame to flip, cameras: {}", cameras),
                  fmt::format("only {} frames were shown", shown.size()));
    return;
  }
  const auto quantile = [&](double share, auto&& of) {
    std::vector<double> values;
    for (const ShownFrame& one : shown) values.push_back(of(one));
    return Quantile(values, share);
  };
  const double limit_ms = 1e3 / kFrames_Hz;
  const auto tracked = [](const ShownFrame& one) { return one.received; };
  const auto waited = [](const ShownFrame& one) { return one.begun - one.received; };
  const auto drawn = [](const ShownFrame& one) { return one.committed - one.begun; };
  const auto screen = [](const ShownFrame& one) { return one.flipped - one.committed; };
  const auto flipped = [](const ShownFrame& one) { return one.flipped; };
  for (const double share : {0.5, 0.95}) {
    const double ms = quantile(share, flipped), drawn_ms = quantile(share, drawn);
    fmt::print("of {} frames, {:.1f} a second: tags {:.1f}, waiting {:.1f}, refresh {:.1f} ms\n",
               shown.size(), static_cast<double>(shown.size()) / run_s, quantile(share, tracked),
               quantile(share, waited), quantile(share, screen));
    Report({.what = fmt::format("frame to flip, cameras: {}, {:.0f} %", cameras, 100 * share),
            .ours = ms,
            .unit = "ms",
            .goal = RatioAtMost(1),
            .peer = "limit: a frame and its drawing",
            .peers = limit_ms + drawn_ms});
  }
}

/// Peak memory of daemon and viewer together.
void MeasureMemory(const ViewStation& station, double run_s) {
  os::ChildProcess viewer = station.StartViewer(0);
  double peak_mb = 0;
  const auto sample_for = [&](double seconds, auto&& done) {
    for (const double until_s = MonotonicSeconds() + seconds; MonotonicSeconds() < until_s;) {
      peak_mb = std::max(peak_mb, PssOfAllMb(station.daemon()) + PssOfAllMb(viewer.pid()));
      if (done()) return;
      SleepSeconds(0.02);
    }
  };
  // Meshes are read by children of the viewer.
  bool reading = false;
  sample_for(60, [&] {
    const bool now = HasChildren(viewer.pid());
    return std::exchange(reading, reading || now) && !now;
  });
  sample_for(run_s / 2, [] { return false; });
  double daemon_mb = 0, viewer_mb = 0;
  for (const double until_s = MonotonicSeconds() + run_s; MonotonicSeconds() < until_s;) {
    const double daemon_now_mb = PssOfAllMb(station.daemon()),
                 viewer_now_mb = PssOfAllMb(viewer.pid());
    if (daemon_now_mb + viewer_now_mb > daemon_mb + viewer_mb) {
      daemon_mb = daemon_now_mb;
      viewer_mb = viewer_now_mb;
    }
    SleepSeconds(0.2);
  }
  ViewStation::Stop(viewer);
  const double sum_mb = daemon_mb + viewer_mb;
  fmt::print("daemon {:.0f} MB, viewer {:.0f} MB; while meshes are read {:.0f} MB\n", daemon_mb,
             viewer_mb, peak_mb);
  Report({.what = "memory of daemon and viewer, two cameras and two meshes (PSS)",
          .ours = sum_mb,
          .unit = "MB",
          .goal = AtMost(220),
          .timed = false});
}

/// Lateness of the control cycle alternately without and with the viewer, and once more without, to
/// show the noise of the machine.
void MeasureCycle(const ViewStation& station, double run_s, int runs) {
  std::vector<double> without_ms, with_ms, again_ms;
  for (int run = 0; run < runs; ++run) {
    without_ms.push_back(StartP99_ms(station, run_s));
    os::ChildProcess viewer = station.StartViewer(kUnitsNice);
    SleepSeconds(run_s / 3);
    with_ms.push_back(StartP99_ms(station, run_s));
    ViewStation::Stop(viewer);
    again_ms.push_back(StartP99_ms(station, run_s));
  }
  const double a = Quantile(without_ms, 0.5), b = Quantile(with_ms, 0.5),
               c = Quantile(again_ms, 0.5);
  fmt::print(
      "99 % of the start lateness: with the viewer {:.3f} ms, without {:.3f} and {:.3f} ms\n", b, a,
      c);
  Report({.what = "start lateness of the cycle, 99 %, added by the viewer",
          .ours = b - a,
          .unit = "ms",
          .goal = AtMost(0.2)});
}

/// Restricts this process and its children to the first two CPU cores that it may use.
void TakeTwoCores() {
  cpu_set_t may, two;
  CPU_ZERO(&two);
  sched_getaffinity(0, sizeof may, &may);
  for (int core = 0; core < CPU_SETSIZE && CPU_COUNT(&two) < 2; ++core) {
    if (CPU_ISSET(core, &may)) CPU_SET(core, &two);
  }
  sched_setaffinity(0, sizeof two, &two);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "--viewer") == 0) return RunViewer(argv[2]);
  if (argc < 2) {
    fmt::print(stderr, "usage: view_bench PLUMBLINED [--smoke | --quick | --hold SECONDS]\n");
    return 2;
  }
  const Effort effort = EffortFrom(argc, argv);
  const double run_s = Choose(effort, 1.0, 6.0, 20.0);
  const bool hold = argc > 3 && std::strcmp(argv[2], "--hold") == 0;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  TakeTwoCores();
  const WorkFolder own;
  const std::string& folder = own.path();
  if (hold) {
    const ViewStation held(folder, argv[1], 2);
    SleepSeconds(2);
    os::ChildProcess viewer = held.StartViewer(0);
    fmt::print("daemon {} viewer {}\n", held.daemon(), viewer.pid());
    SleepSeconds(std::strtod(argv[3], nullptr));
    ViewStation::Stop(viewer);
    return 0;
  }
  fmt::print("1920x1080 at {:g} Hz, {:g} Hz screen, two meshes of 50,000 triangles, two cores\n\n",
             kFrames_Hz, kRefresh_Hz);
  MeasureFlips(folder + "/one", argv[1], 1, run_s);
  MeasureFlips(folder + "/two", argv[1], 2, run_s);
  const ViewStation station(folder + "/all", argv[1], 2);
  SleepSeconds(3);
  MeasureMemory(station, run_s);
  MeasureCycle(station, run_s / 2, Choose(effort, 1, 5, 5));
  return 0;
}
