// Benchmark of the guidance of a lens calibration: views that a simulated person needs until the
// claim is met, guided and free hand, and the time to choose a view.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "app/vision/camera/board_session.h"
#include "tests/app/vision/camera/outline_pose.h"
#include "tests/app/vision/lens/stated_camera.h"
#include "tests/bench/bench_timing.h"
#include "tests/bench/rows.h"
#include "tests/lens_captures/simulated_hand.h"

namespace {

using namespace plumbline;
using namespace plumbline::lens_captures;
using Habit = SimulatedHand::Habit;

constexpr int kLeastViews = 6, kMostViews = 60;
constexpr double kSufficientShare = 0.9;  ///< of the image, as the daemon asks for
constexpr double kAttempt_s = 3, kFrame_s = 0.05;
constexpr int kHeldFrames = 3;

struct Person {
  double views = 0;
  double attempts = 0;     ///< poses held, kept or not
  double error_in_sd = 0;  ///< true error in units of the stated standard deviation
  bool accepted = false;
};

lens::Lens TrueLens(const CameraModel& camera) {
  return {camera.fx,   camera.fy,   camera.cx,   camera.cy,  camera.k[0],
          camera.k[1], camera.p[0], camera.p[1], camera.k[2]};
}

double ErrorOf(const Conditions& c, const vision::LensCalibration& stated) {
  return LargestError(c.camera, test::StatedCamera(stated.lens), c.width, c.height,
                      stated.usable_radius_px) /
         stated.uncertainty.max_px;
}

Person FreeHand(std::uint64_t seed, Habit habit, double acceptable_px) {
  Random random(seed);
  const Conditions c = GoodConditions(random);
  SimulatedHand hand(c, random);
  std::vector<vision::BoardView> views;
  vision::CalibrationOptions options;
  options.acceptable_px = acceptable_px;
  Person person;
  while (person.views < kMostViews && !person.accepted) {
    views.push_back(hand.Free(habit));
    hand.CountView();
    views.back().time_s = ++person.views;
    if (person.views < kLeastViews) continue;
    const auto result = vision::CalibrateLens(c.board, views, {c.width, c.height}, options);
    const bool enough = !result.further_views_help || UsableShare(result) >= kSufficientShare;
    person.accepted = result.accepted && enough;
    if (person.accepted) person.error_in_sd = ErrorOf(c, result);
  }
  person.attempts = person.views;
  return person;
}

Person Guided(std::uint64_t seed, double acceptable_px, std::vector<double>& choice_ms) {
  Random random(seed);
  const Conditions c = GoodConditions(random);
  SimulatedHand hand(c, random);
  vision::BoardSettings settings;
  settings.board = c.board;
  settings.views = kLeastViews;
  settings.max_views = kMostViews;
  settings.options.acceptable_px = acceptable_px;
  settings.patience_s = 600;
  vision::BoardSession session(settings, {c.width, c.height}, 0);
  Person person;
  double time_s = 0;
  while (session.state() == vision::BoardSession::State::kCapturing) {
    ++person.attempts;
    const Pose X_CK =
        test::PoseOfOutline(session.guidance().wanted_px, c.board, TrueLens(c.camera));
    const auto held = hand.Following(X_CK);
    time_s += kAttempt_s;
    const std::size_t kept = session.kept();
    for (int frame = 0; frame < kHeldFrames && session.kept() == kept; ++frame) {
      vision::BoardView view = held;
      view.time_s = time_s += kFrame_s;
      session.Take(std::move(view));
    }
    if (session.state() != vision::BoardSession::State::kCapturing) break;
    const double start_ms = bench::CpuTime_ms();
    const vision::NextViewChoice choice(
        c.board, vision::KnowledgeFrom(c.board, session.views(), {c.width, c.height}),
        {c.width, c.height}, std::nullopt);
    choice_ms.push_back(bench::CpuTime_ms() - start_ms);
  }
  person.views = static_cast<double>(session.kept());
  person.accepted = session.state() == vision::BoardSession::State::kAccepted;
  if (person.accepted) person.error_in_sd = ErrorOf(c, *session.calibration());
  return person;
}

double MedianViews(const std::vector<Person>& people) {
  std::vector<double> views;
  for (const Person& person : people) views.push_back(person.views);
  return bench::Median(views);
}

void Print(const char* who, const std::vector<Person>& people) {
  double views = 0, attempts = 0, worst = 0;
  int refused = 0, wrong = 0;
  for (const Person& person : people) {
    views += person.views;
    attempts += person.attempts;
    worst = std::max(worst, person.error_in_sd);
    wrong += person.error_in_sd > 3 ? 1 : 0;
    refused += person.accepted ? 0 : 1;
  }
  const auto n = static_cast<double>(people.size());
  fmt::print(
      "  {:<22} views: mean {:.1f}, median {:.0f}; poses held {:.1f}; not accepted {}; error at "
      "most "
      "{:.1f} stated sd, above 3 sd {}\n",
      who, views / n, MedianViews(people), attempts / n, refused, worst, wrong);
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Effort effort = bench::EffortFrom(argc, argv);
  const int people = bench::Choose(effort, 1, 12, 40);
  std::uint64_t seed = 20261129;
  for (int k = 1; k + 1 < argc; ++k) {
    if (std::string_view(argv[k]) == "--seed") seed = std::strtoull(argv[k + 1], nullptr, 10);
  }
  std::vector<double> choice_ms;
  const std::vector<double> claims_px =
      effort == bench::Effort::kSmoke ? std::vector{0.5} : std::vector{0.5, 0.2};
  for (const double acceptable_px : claims_px) {
    std::vector<Person> casual, by_manual, guided;
    for (int k = 0; k < people; ++k) {
      const std::uint64_t own = seed + static_cast<std::uint64_t>(k);
      casual.push_back(FreeHand(own, Habit::kCasual, acceptable_px));
      by_manual.push_back(FreeHand(own, Habit::kByManual, acceptable_px));
      guided.push_back(Guided(own, acceptable_px, choice_ms));
    }
    fmt::print("claim: standard deviation of the projection {} px, {} people\n", acceptable_px,
               people);
    Print("free hand, casual", casual);
    Print("free hand, by manual", by_manual);
    Print("guided", guided);
    const auto report = [&](const char* habit, const std::vector<Person>& free) {
      bench::Report({.what = fmt::format("views until the claim of {} px is met, guided over {}",
                                         acceptable_px, habit),
                     .ours = MedianViews(guided) / MedianViews(free),
                     .goal = bench::AtMost(0.5),
                     .timed = false});
    };
    report("free hand, casual", casual);
    report("free hand by the manual", by_manual);
  }
  bench::Report({.what = "choice of the next view of a calibration board, CPU",
                 .ours = bench::Median(choice_ms),
                 .unit = "ms",
                 .goal = bench::AtMost(100)});
}
