// The monitor as a whole: the real daemon with recorded cameras, and the viewer in a process of its
// own, with a card that this file plays (60 Hz). From a camera's frame to the flip that shows it;
// memory of all; what drawing does to the machine's cycle. All on two cores.
#include <sched.h>
#include <sys/signalfd.h>

#include <cstring>

#include "app/view_process/view_loop.h"
#include "tests/bench/view_station.h"
#include "tests/drivers/display/fake_card.h"

using namespace plumbline;
using namespace plumbline::bench;

namespace {

constexpr double kRefresh_Hz = 60;
constexpr int kUnitsNice = 10;  ///< systemd/plumbline-view.service

/// The viewer: what plumbline-view does, on a card of this process. Prints, at its end, the times
/// of each frame that was shown.
int BeViewer(const std::string& config_file) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  KeepHeapSmall();
  const int ended = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  test::FakeCard card;
  card.modes = {{1920, 1080}};
  std::ifstream given(config_file);
  std::string text{std::istreambuf_iterator<char>(given), {}};
  const std::string mine = config_file + ".view";
  std::ofstream(mine) << text.replace(text.find(kCard), kCard.size(), card.path);

  Shown shown;
  std::optional<ShownFrame> committed;  // since frame_s
  double frame_s = 0;
  std::uint64_t sequence = 0;
  const ViewLoop* drawing = nullptr;
  card.on_commit = [&] {
    committed.reset();
    if (drawing == nullptr || drawing->state().cameras.empty()) return;
    const ViewState& state = drawing->state();
    const auto& image = state.cameras.front().image;
    if (!image || image->sequence == sequence) return;
    sequence = image->sequence;
    frame_s = image->time_s;
    committed = {1e3 * (state.now_s - frame_s), 1e3 * (drawing->begun_s() - frame_s),
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
  FaultList faults;
  auto model = ReadViewModel(mine, 0, faults);
  if (!model) fmt::print(stderr, "{}", FaultsText(faults));
  if (model) {
    ViewLoop loop(mine, std::move(*model), shown);
    drawing = &loop;
    signalfd_siginfo info{};
    while (read(ended, &info, sizeof info) != sizeof info) loop.Round();
  }
  stop = true;
  screen.join();
  for (const ShownFrame& one : frames) {
    fmt::print("{:.3f} {:.3f} {:.3f} {:.3f}\n", one.told, one.begun, one.committed, one.flipped);
  }
  return 0;
}

const char* Met(bool met) {
  return met ? "yes" : "NO";
}

/// The share of beginnings between two looks that was no later than the answer [ms].
double QuantileBetween(const LatenessCounts& from, const LatenessCounts& to, double share) {
  std::array<double, LatenessCounts::kClasses> count{};
  double all = 0;
  for (std::size_t k = 0; k < count.size(); ++k) {
    all += count[k] = static_cast<double>(to.counts[k] - from.counts[k]);
  }
  double wanted = share * all, low_s = 0;
  for (std::size_t k = 0; k < LatenessCounts::kBounds_s.size(); ++k) {
    const double high_s = LatenessCounts::kBounds_s[k];
    if (count[k] > 0 && wanted <= count[k]) {
      return 1e3 * (low_s + wanted / count[k] * (high_s - low_s));
    }
    wanted -= count[k];
    low_s = high_s;
  }
  return 1e3 * low_s;
}

double StartP99_ms(const ViewStation& station, double seconds) {
  const LatenessCounts from = station.Starts();
  SleepSeconds(seconds);
  return QuantileBetween(from, station.Starts(), 0.99);
}

/// From a frame to its flip, and where the time goes.
void MeasureFlips(const std::string& folder, const char* program, int cameras, double run_s) {
  const ViewStation station(folder, program, cameras);
  const pid_t viewer = station.StartViewer(0);
  SleepSeconds(run_s);
  const std::vector<ShownFrame> shown = station.EndViewer(viewer);
  if (shown.size() < 20) {
    fmt::print("SKIPPED: {} frames were shown; see {}/view.log and log\n", shown.size(), folder);
    return;
  }
  const auto quantile = [&](double share, auto&& of) {
    std::vector<double> values;
    for (const ShownFrame& one : shown) values.push_back(of(one));
    return Quantile(values, share);
  };
  const double limit_ms = 1e3 / kFrames_Hz;
  const auto told = [](const ShownFrame& one) { return one.told; };
  const auto waited = [](const ShownFrame& one) { return one.begun - one.told; };
  const auto drawn = [](const ShownFrame& one) { return one.committed - one.begun; };
  const auto screen = [](const ShownFrame& one) { return one.flipped - one.committed; };
  const auto flipped = [](const ShownFrame& one) { return one.flipped; };
  for (const double share : {0.5, 0.95}) {
    const double ms = quantile(share, flipped), drawn_ms = quantile(share, drawn);
    fmt::print(
        "| frame to flip, {} camera{}, {:.0f} % of {} ({:.1f} a second) | {:.1f} ms | tags {:.1f}, "
        "newer wanted {:.1f}, drawn {:.1f}, refresh {:.1f} | <= {:.1f} + {:.1f} ms (a frame + "
        "drawing) | {} |\n",
        cameras, cameras > 1 ? "s" : "", 100 * share, shown.size(),
        static_cast<double>(shown.size()) / run_s, ms, quantile(share, told),
        quantile(share, waited), drawn_ms, quantile(share, screen), limit_ms, drawn_ms,
        Met(ms <= limit_ms + drawn_ms));
  }
}

/// Both at their most: meshes read, pictures remembered, pages touched.
void MeasureMemory(const ViewStation& station, double run_s) {
  const pid_t viewer = station.StartViewer(0);
  double most_mb = 0;
  const auto look_for = [&](double seconds, auto&& enough) {
    for (const double until_s = MonotonicSeconds() + seconds; MonotonicSeconds() < until_s;) {
      most_mb = std::max(most_mb, PssOfAllMb(station.daemon()) + PssOfAllMb(viewer));
      if (enough()) return;
      SleepSeconds(0.02);
    }
  };
  look_for(60, [&] { return station.ViewerSays(" triangles"); });
  look_for(8, [] { return false; });
  double daemon_mb = 0, viewer_mb = 0;
  for (const double until_s = MonotonicSeconds() + run_s; MonotonicSeconds() < until_s;) {
    const double daemon_now_mb = PssOfAllMb(station.daemon()), viewer_now_mb = PssOfAllMb(viewer);
    if (daemon_now_mb + viewer_now_mb > daemon_mb + viewer_mb) {
      daemon_mb = daemon_now_mb;
      viewer_mb = viewer_now_mb;
    }
    SleepSeconds(0.2);
  }
  station.EndViewer(viewer);
  const double sum_mb = daemon_mb + viewer_mb;
  fmt::print(
      "| memory, two cameras (PSS of daemon, monitor and their children, the most of {:.0f} s) | "
      "{:.0f} MB | {:.0f} + {:.0f} | <= 220 MB | {} |\n",
      run_s, sum_mb, daemon_mb, viewer_mb, Met(sum_mb <= 220));
  fmt::print("| the same while meshes are read and shaders compiled | {:.0f} MB | | | |\n",
             most_mb);
}

/// The cycle without and with the monitor by turns, and twice without: what the machine adds.
void MeasureCycle(const ViewStation& station, double run_s) {
  std::vector<double> without_ms, with_ms, again_ms;
  for (int run = 0; run < 5; ++run) {
    without_ms.push_back(StartP99_ms(station, run_s));
    const pid_t viewer = station.StartViewer(kUnitsNice);
    SleepSeconds(3);
    with_ms.push_back(StartP99_ms(station, run_s));
    station.EndViewer(viewer);
    again_ms.push_back(StartP99_ms(station, run_s));
  }
  const double a = Quantile(without_ms, 0.5), b = Quantile(with_ms, 0.5),
               c = Quantile(again_ms, 0.5);
  fmt::print(
      "| start of the cycle, 99 %: with the monitor, and without (medians of five) | {:.3f} ms "
      "| {:.3f} ms | <= 0.2 ms more: {:+.3f} | {} |\n",
      b, a, b - a, Met(b - a <= 0.2));
  fmt::print(
      "| the same, without and without: the machine's own noise | {:.3f} ms | {:.3f} ms | "
      "{:+.3f} | |\n",
      c, a, c - a);
}

/// This process and all that it starts, on the first two cores that it may use.
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
  if (argc == 3 && std::strcmp(argv[1], "--viewer") == 0) return BeViewer(argv[2]);
  if (argc < 2) {
    fmt::print(stderr, "usage: view_bench PLUMBLINED [--quick | --hold SECONDS]\n");
    return 2;
  }
  const bool quick = argc > 2 && std::strcmp(argv[2], "--quick") == 0;
  const double run_s = quick ? 6 : 20;
  const bool hold = argc > 3 && std::strcmp(argv[2], "--hold") == 0;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  TakeTwoCores();
  char pattern[] = "/tmp/plumbline-view-bench-XXXXXX";
  const std::string folder = mkdtemp(pattern);
  if (hold) {
    const ViewStation held(folder, argv[1], 2);
    SleepSeconds(2);
    const pid_t viewer = held.StartViewer(0);
    fmt::print("daemon {} viewer {}\n", held.daemon(), viewer);
    SleepSeconds(std::strtod(argv[3], nullptr));
    held.EndViewer(viewer);
    return 0;
  }
  fmt::print("1920x1080 at {:g} Hz, {:g} Hz screen, two meshes of 50,000 triangles, two cores\n\n",
             kFrames_Hz, kRefresh_Hz);
  fmt::print("| what | ours | | target | met |\n|---|---|---|---|---|\n");
  MeasureFlips(folder + "/one", argv[1], 1, run_s);
  MeasureFlips(folder + "/two", argv[1], 2, run_s);
  const ViewStation station(folder + "/all", argv[1], 2);
  SleepSeconds(3);
  MeasureMemory(station, run_s);
  MeasureCycle(station, run_s / 2);
  return 0;
}
