// Evaluation of the lens calibration on captures that go wrong in a known way: false acceptances,
// good captures accepted, and causes named. lens_evaluation [--seed N] [--runs N] [--kind TEXT]
// [--declare] [--least] [-v]
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "app/vision/lens/calibration.h"
#include "tests/app/vision/lens/stated_camera.h"
#include "tests/lens_captures/capture_maker.h"

using namespace plumbline;
using namespace plumbline::lens_captures;

namespace {

struct Arguments {
  std::uint64_t seed = 1;
  int runs = 30;
  std::string kind;
  bool verbose = false, declare = false, least = false;
};

Arguments ArgumentsOf(int argc, char** argv) {
  Arguments arguments;
  for (int k = 1; k < argc; ++k) {
    const std::string name = argv[k];
    const char* value = k + 1 < argc ? argv[k + 1] : "";
    if (name == "--help" || name == "-h") {
      fmt::print(
          "lens_evaluation [--seed N] [--runs N] [--kind TEXT] [--declare] [--least] [-v]\n"
          "  --runs  captures of each kind (30), a tenth as many of the rendered kinds\n"
          "  --kind  only the kinds whose name contains the text\n"
          "  --declare  no window and a fixed focus, for the kinds of which that is true\n"
          "  --least   accept what a capture proves, instead of at most 0.5 px\n"
          "  -v      print each mistake\n");
      std::exit(0);
    }
    if (name == "--seed") arguments.seed = std::strtoull(value, nullptr, 10);
    if (name == "--runs") arguments.runs = static_cast<int>(std::strtol(value, nullptr, 10));
    if (name == "--kind") arguments.kind = value;
    if (name == "-v") arguments.verbose = true;
    if (name == "--declare") arguments.declare = true;
    if (name == "--least") arguments.least = true;
  }
  return arguments;
}

struct Counts {
  int runs = 0, accepted = 0, in_part = 0, falsely_accepted = 0, refused_bad = 0, named = 0,
      unclear = 0, uncertain = 0;
  std::vector<double> z;  ///< true error in units of the claimed one, of the accepted captures
  void Add(const Counts& other) {
    runs += other.runs;
    accepted += other.accepted;
    in_part += other.in_part;
    falsely_accepted += other.falsely_accepted;
    refused_bad += other.refused_bad;
    named += other.named;
    unclear += other.unclear;
    uncertain += other.uncertain;
    z.insert(z.end(), other.z.begin(), other.z.end());
  }
};

/// Whether the reasons contain one of the words before their advice, which follows a semicolon. An
/// effect that is only not excluded is not named.
bool Names(const std::vector<std::string>& reasons, const std::string& words) {
  std::string all;
  for (const std::string& reason : reasons) {
    const std::string before_advice = reason.substr(0, reason.find(';'));
    if (before_advice.find("not excluded") == std::string::npos) all += before_advice + "\n";
  }
  std::size_t start = 0;
  while (start <= words.size()) {
    const std::size_t end = std::min(words.find('|', start), words.size());
    if (end > start && all.find(words.substr(start, end - start)) != std::string::npos) return true;
    start = end + 1;
  }
  return false;
}

/// Whether the reasons state no cause, but effects that are not excluded, or views that are
/// missing.
bool StatesNoCause(const std::vector<std::string>& reasons) {
  return std::all_of(reasons.begin(), reasons.end(), [](const std::string& reason) {
    return reason.find("not excluded") != std::string::npos ||
           reason.find("take more views") != std::string::npos ||
           reason.find("the board was seen only") != std::string::npos ||
           reason.find("views are too similar") != std::string::npos ||
           reason.find("even so, ") == 0;
  });
}

/// What an owner could declare truthfully of the cameras of this kind.
target::DeclaredFacts TrueOf(const Kind& kind) {
  const auto not_named = [&](const char* word) {
    return kind.words.find(word) == std::string::npos;
  };
  return {not_named("window"), not_named("focal length")};
}

Counts RunKind(const Kind& kind, const Arguments& arguments) {
  Counts counts;
  vision::CalibrationOptions options;
  if (arguments.declare) options.declared = TrueOf(kind);
  options.accept_least = arguments.least;
  // A rendered capture takes seconds.
  const int runs = kind.rendered ? (arguments.runs + 9) / 10 : arguments.runs;
  for (int run = 0; run < runs; ++run) {
    const std::uint64_t seed = arguments.seed * 100003 + static_cast<std::uint64_t>(run);
    Random random(seed ^ std::hash<std::string>{}(kind.name));
    Conditions conditions = GoodConditions(random);
    kind.prepare(conditions, random);
    SimulatedCapture capture = Simulate(conditions, random);
    if (kind.rendered) capture.views = Photograph(capture, kind.photo, random);
    const vision::LensCalibration c = vision::CalibrateLens(
        conditions.board, capture.views, {conditions.width, conditions.height}, options);
    const CameraModel stated = test::StatedCamera(c.lens);
    const double error = c.lens.fx > 0 ? LargestError(conditions.camera, stated, conditions.width,
                                                      conditions.height, c.usable_radius_px)
                                       : INFINITY;
    const double claimed = c.uncertainty.max_px;
    // At 0.3 px three claimed standard deviations are exceeded; below, five.
    const bool wrong = error > 5 * claimed || (error > 3 * claimed && error > 0.3);
    ++counts.runs;
    counts.accepted += c.accepted;
    if (c.accepted) counts.z.push_back(error / claimed);
    counts.in_part += c.accepted && !UsableEverywhere(c);
    counts.falsely_accepted += c.accepted && wrong;
    const bool unclear = !c.accepted && Names(c.reasons, "not clear");
    const bool named = !c.accepted && !unclear && Names(c.reasons, kind.words);
    counts.refused_bad += !c.accepted;
    counts.named += named;
    counts.unclear += unclear;
    counts.uncertain += !c.accepted && !named && !unclear && StatesNoCause(c.reasons);
    const bool notable = (c.accepted && wrong) ||
                         (!c.accepted && !named && kind.expected != Kind::Expected::kGood) ||
                         (!c.accepted && kind.expected == Kind::Expected::kGood);
    if (!arguments.verbose || !notable) continue;
    fmt::print(
        "  run {}: {} x {}, f {:.0f}, {} views, noise {:.3f} px, {} x {}: {}, error {:.3g}, "
        "claimed {:.3g} px\n",
        run, conditions.width, conditions.height, conditions.camera.fx, capture.views.size(),
        conditions.noise_px, conditions.board.columns, conditions.board.rows,
        c.accepted ? "ACCEPTED" : "refused", error, claimed);
    for (const std::string& reason : c.reasons) fmt::print("    {}\n", reason);
  }
  return counts;
}

/// The value that the share `part` of the values does not exceed.
double Quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = ArgumentsOf(argc, argv);
  Counts good, bad;
  int kinds = 0;
  for (const Kind& kind : AllKinds()) {
    if (kind.name.find(arguments.kind) == std::string::npos) continue;
    const Counts counts = RunKind(kind, arguments);
    const bool is_good = kind.expected == Kind::Expected::kGood;
    (is_good ? good : bad).Add(counts);
    kinds += is_good ? 0 : 1;
    fmt::print("{:42} accepted {:3} of {} (in part {:3}), falsely {:3}", kind.name, counts.accepted,
               counts.runs, counts.in_part, counts.falsely_accepted);
    if (!is_good) {
      fmt::print("; cause named {:3}, not clear {:3}, no cause stated {:3}, wrong {:3}",
                 counts.named, counts.unclear, counts.uncertain,
                 counts.refused_bad - counts.named - counts.unclear - counts.uncertain);
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
  fmt::print(
      "{} bad kinds, seed {}\nfalse acceptances: {} of {} (goal 0 of 2000), of which good "
      "kinds {} of {}\n",
      kinds, arguments.seed, bad.falsely_accepted + good.falsely_accepted, bad.runs + good.runs,
      good.falsely_accepted, good.runs);
  for (const auto& [name, counts] : {std::pair("good", &good), {"other", &bad}}) {
    fmt::print(
        "largest error over claimed, accepted {} kinds: median {:.2f}, 95 % {:.2f}, 99 % {:.2f}\n",
        name, Quantile(counts->z, 0.5), Quantile(counts->z, 0.95), Quantile(counts->z, 0.99));
  }
  fmt::print(
      "good captures accepted: {} of {} ({:.1f} %, goal 99 %), {} of them for a part of the "
      "image\n",
      good.accepted, good.runs, 100.0 * good.accepted / std::max(1, good.runs), good.in_part);
  fmt::print(
      "refused with the true cause: {} of {} ({:.1f} %, goal 90 %); cause not clear {}, "
      "no cause stated {}, another cause stated {}\n",
      bad.named, bad.refused_bad, 100.0 * bad.named / std::max(1, bad.refused_bad), bad.unclear,
      bad.uncertain, bad.refused_bad - bad.named - bad.unclear - bad.uncertain);
  if (kinds == 0 && good.runs == 0) {
    fmt::print(stderr, "lens_evaluation: no kind contains \"{}\"\n", arguments.kind);
    return 2;
  }
}
