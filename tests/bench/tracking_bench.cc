// Benchmark of tag tracking in rendered scenes: time, corners and poses, against AprilTag (decimate
// 2, and 1 for small tags) and OpenCV's ArUco on the same images in the same run. One CPU core.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>

#include "app/vision/tracking/bodies.h"
#include "app/vision/tracking/tracker.h"
#include "tests/app/vision/tracking/natural_image.h"
#include "tests/app/vision/tracking/tag_scene.h"
#include "tests/bench/bench_timing.h"
#include "tests/bench/rows.h"
#include "tests/bench/tag_peers.h"

using namespace plumbline;
using bench::Peers, bench::Seen;

namespace {

double Median_ms(int times, const std::function<void()>& work) {
  std::vector<double> ms;
  for (int k = 0; k < times; ++k) {
    const double start = bench::CpuTime_ms();
    work();
    ms.push_back(bench::CpuTime_ms() - start);
  }
  return bench::Median(ms);
}

struct Score {
  int found = 0, tags = 0;
  double squares = 0, ms = 0;
  int scenes = 0;

  void Add(const test::TagScene& scene, const Seen& seen) {
    tags += static_cast<int>(scene.ids.size());
    for (std::size_t k = 0; k < scene.ids.size(); ++k) {
      for (const auto& [id, corners] : seen) {
        if (id != scene.ids[k] || (corners[0] - scene.corners[k][0]).norm() > 6) continue;
        ++found;
        for (int c = 0; c < 4; ++c) squares += (corners[c] - scene.corners[k][c]).squaredNorm();
        break;
      }
    }
  }
  double rmse() const { return std::sqrt(squares / std::max(1, 8 * found)); }
  double mean_ms() const { return ms / scenes; }
};

Seen SeenBy(const vision::SeenTags& tags) {
  Seen seen;
  for (const vision::SeenTag& tag : tags.tags) seen.emplace_back(tag.id, tag.corners_px);
  return seen;
}

void SixTagScenes(const char* name, const renderer::Conditions& light, double side_px, int scenes,
                  int times) {
  static const Peers peers;
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  Score ours, tracked, april, aruco;
  for (int s = 0; s < scenes; ++s) {
    const test::TagScene scene =
        test::SixTags(family, renderer::ZoomLens(1500 + 400 * (s % 10)), side_px, 0.8, 1000 + s);
    renderer::Image image = renderer::Render(scene.camera, scene.sheets, light, s);
    const image::LumaView view = test::ViewOf(image);
    const lens::Lens lens = test::LensOfCamera(scene.camera);
    vision::TagDetector detector(family, {});
    vision::SeenTags seen;
    ours.ms += Median_ms(times, [&] { detector.Detect(view, &lens, seen); });
    ours.Add(scene, SeenBy(seen));
    target::TagDatabase database;
    database.default_side_m = scene.side_m;
    vision::Tracker tracker(family, database, {.full_search_interval = 1 << 30});
    const lens::KnownLens known{lens};
    double t = 0;
    tracker.Update(view, t, &known);
    bool whole = false;
    tracked.ms +=
        Median_ms(times, [&] { whole |= tracker.Update(view, t += 0.04, &known).full_search; });
    if (whole) fmt::print("(a tag was lost while tracking)\n");
    Seen by;
    april.ms += Median_ms(times, [&] { by = peers.April(image); });
    april.Add(scene, by);
    aruco.ms += Median_ms(times, [&] { by = peers.Aruco(image); });
    aruco.Add(scene, by);
    for (Score* score : {&ours, &tracked, &april, &aruco}) ++score->scenes;
  }
  const auto row = [&](const char* who, const Score& score) {
    fmt::print("| {} | {} | {:.2f} | {:.2f} | {} of {} | {:.4f} |\n", name, who, score.mean_ms(),
               score.mean_ms() / april.mean_ms(), score.found, score.tags, score.rmse());
  };
  row("Plumbline, whole frame", ours);
  fmt::print("| {} | Plumbline, tracked, with poses | {:.2f} | {:.2f} | | |\n", name,
             tracked.mean_ms(), tracked.mean_ms() / april.mean_ms());
  const auto compare = [&](const std::string& what, double value, double april_value,
                           const char* unit) {
    bench::Report({.what = fmt::format("tags of {}: {}", name, what),
                   .ours = value,
                   .unit = unit,
                   .peer = "AprilTag, decimate 2",
                   .peers = april_value,
                   .timed = unit == std::string_view("ms")});
  };
  compare("whole 1080p frame", ours.mean_ms(), april.mean_ms(), "ms");
  compare("tracked, with poses", tracked.mean_ms(), april.mean_ms(), "ms");
  compare("corners, RMS", ours.rmse(), april.rmse(), "px");
  row("AprilTag, decimate 2", april);
  row("OpenCV ArUco, sub-pixel", aruco);
}

/// Small tags, tilted by up to 0.6 rad, against AprilTag without decimation.
void SmallTags(int scenes, int times, int sizes) {
  static const Peers peers(1);
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  vision::TagDetector detector(family, {.strict = true});
  fmt::print(
      "\nSmall tags, whole frame; AprilTag without decimation\n\n"
      "| side px | found | AprilTag | ratio | corner RMSE px | AprilTag | ms | AprilTag | ratio |\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  for (const double side_px : {30, 24, 20, 18, 16, 14, 12}) {
    if (sizes-- == 0) break;
    Score ours, april;
    for (int s = 0; s < scenes; ++s) {
      const test::TagScene scene =
          test::SixTags(family, renderer::ZoomLens(1500 + 400 * (s % 10)), side_px, 0.6, 3000 + s);
      renderer::Image image = renderer::Render(scene.camera, scene.sheets, {}, s);
      const lens::Lens lens = test::LensOfCamera(scene.camera);
      vision::SeenTags seen;
      ours.ms += Median_ms(times, [&] { detector.Detect(test::ViewOf(image), &lens, seen); });
      ours.Add(scene, SeenBy(seen));
      Seen by;
      april.ms += Median_ms(1, [&] { by = peers.April(image); });
      april.Add(scene, by);
      ++ours.scenes, ++april.scenes;
    }
    fmt::print("| {:.0f} | {} of {} | {} | {:.2f} | {:.3f} | {:.3f} | {:.1f} | {:.0f} | {:.2f} |\n",
               side_px, ours.found, ours.tags, april.found,
               static_cast<double>(ours.found) / std::max(1, april.found), ours.rmse(),
               april.rmse(), ours.mean_ms(), april.mean_ms(), ours.mean_ms() / april.mean_ms());
    bench::Report({.what = fmt::format("small tags of {:.0f} px found of {}", side_px, ours.tags),
                   .ours = static_cast<double>(ours.found),
                   .peer = "AprilTag, no decimation",
                   .peers = static_cast<double>(april.found),
                   .timed = false});
  }
}

/// False tags in images without tags, by family; AprilTag without decimation on the same images.
void NaturalImages(int images) {
  static const Peers peers(1);
  constexpr const char* kFamilies[] = {"36h11",        "36h10",         "25h9",         "16h5",
                                       "aruco-4x4-50", "aruco-5x5-100", "aruco-6x6-250"};
  std::vector<vision::TagDetector> detectors;
  for (const char* family : kFamilies) {
    detectors.emplace_back(*target::TagFamilyOfName(family),
                           vision::DetectorSettings{.strict = true});
  }
  std::vector<int> wrong(detectors.size());
  int april = 0;
  double ms = 0, worst_ms = 0, april_ms = 0;
  for (int k = 0; k < images; ++k) {
    renderer::Image image;
    image.width = 1920, image.height = 1080;
    image.grey = test::NaturalImage(1920, 1080, 500 + 400 * (k % 6), 100 + k);
    for (std::size_t f = 0; f < detectors.size(); ++f) {
      vision::SeenTags seen;
      const double took_ms =
          Median_ms(1, [&] { detectors[f].Detect(test::ViewOf(image), nullptr, seen); });
      if (f == 0) ms += took_ms, worst_ms = std::max(worst_ms, took_ms);
      wrong[f] += static_cast<int>(seen.tags.size());
    }
    april_ms += Median_ms(1, [&] { april += static_cast<int>(peers.April(image).size()); });
  }
  for (std::size_t f = 1; f < detectors.size(); ++f) {
    fmt::print("false tags of {}: {}\n", kFamilies[f], wrong[f]);
  }
  bench::Report({.what = fmt::format("false 36h11 tags in {} images like photographs", images),
                 .ours = static_cast<double>(wrong[0]),
                 .goal = bench::AtMost(0),
                 .peer = "AprilTag, no decimation",
                 .peers = static_cast<double>(april),
                 .timed = false});
  bench::Report({.what = "search of such an image, mean",
                 .ours = ms / images,
                 .unit = "ms",
                 .peer = "AprilTag, no decimation",
                 .peers = april_ms / images});
  bench::Report({.what = "search of such an image, longest",
                 .ours = worst_ms,
                 .unit = "ms",
                 .goal = bench::AtMost(12)});
}

lens::Vec2 Middle(const vision::Corners& corners) {
  return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
}

/// Standard deviation of the spread of z for `count` whitened errors of three coordinates each.
double SigmaOfSpread(int count) {
  return 1 / std::sqrt(2.0 * 3 * count);
}

/// Tip 300 mm from a body of six tags (400 x 200 mm) at 1.5 m, f 5000.
void TipOfBody(int scenes) {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  target::Body body{"gripper", {}};
  for (int k = 0; k < 6; ++k) {
    body.tags.push_back(
        {k + 1, 0.08, {Mat3::Identity(), Vec3((k % 3 - 1) * 0.16, (k < 3 ? -0.06 : 0.06), 0)}});
  }
  double squares = 0, turns = 0, whitened = 0;
  int seen_count = 0;
  for (int s = 0; s < scenes; ++s) {
    std::mt19937_64 random(s);
    std::uniform_real_distribution<double> uniform(-1, 1);
    test::TagScene scene;
    scene.camera = renderer::ZoomLens(5000);
    const Eigen::Isometry3d X = test::FacingPose(
        {0.02 * uniform(random), 0.01 * uniform(random), 1.5 + 0.05 * uniform(random)},
        0.35 * uniform(random), 3 * uniform(random), 0.15 * uniform(random));
    for (const target::BodyTag& tag : body.tags) {
      Eigen::Isometry3d X_KM = Eigen::Isometry3d::Identity();
      X_KM.translation() = tag.X_KM.p;
      scene.Add(family, tag.id, X * X_KM);
    }
    const auto image = renderer::Render(scene.camera, scene.sheets, {}, s);
    const lens::KnownLens lens{test::LensOfCamera(scene.camera)};
    vision::TagDetector detector(family, {});
    vision::SeenTags seen;
    detector.Detect(test::ViewOf(image), &lens.lens, seen);
    const auto located = vision::LocateBody(lens, body, seen.tags, std::nullopt);
    if (!located) continue;
    const Vec3 tip(0, 0, 0.3);
    const Vec3 error = located->estimate.X_CK * tip - X * tip;
    const double turn =
        Eigen::AngleAxisd(located->estimate.X_CK.R.transpose() * X.linear()).angle();
    squares += error.squaredNorm();
    turns += turn * turn;
    whitened += error.dot(vision::PointCovariance(located->estimate, tip).ldlt().solve(error)) / 3;
    ++seen_count;
  }
  fmt::print(
      "\nTip of a body of six tags: seen in {} of {} scenes, z spread {:.2f} (1 +- {:.2f})\n",
      seen_count, scenes, std::sqrt(whitened / seen_count), SigmaOfSpread(seen_count));
  bench::Report({.what = "tip 300 mm from a body of six tags, 1.5 m, f 5000, RMS",
                 .ours = 1e3 * std::sqrt(squares / seen_count),
                 .unit = "mm",
                 .goal = bench::AtMost(0.1),
                 .timed = false});
  bench::Report({.what = "rotation of this body, RMS",
                 .ours = std::sqrt(turns / seen_count) * 180 / std::numbers::pi,
                 .unit = "deg",
                 .goal = bench::AtMost(0.02),
                 .timed = false});
}

/// Single tags of 80 mm, 120 px, tilted by 20 to 60 degrees, where the covariance bound is
/// meaningful.
void SingleTags(int scenes) {
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  double squares = 0, bound = 0, whitened = 0;
  int count = 0, ambiguous = 0, flips = 0;
  for (int s = 0; s < scenes; ++s) {
    const auto scene = test::SixTags(family, renderer::ZoomLens(2500), 120, 1.0, 5000 + s);
    const auto image = renderer::Render(scene.camera, scene.sheets, {}, s);
    const lens::KnownLens lens{test::LensOfCamera(scene.camera)};
    vision::TagDetector detector(family, {});
    vision::SeenTags seen;
    detector.Detect(test::ViewOf(image), &lens.lens, seen);
    for (const vision::SeenTag& tag : seen.tags) {
      for (std::size_t k = 0; k < scene.ids.size(); ++k) {
        const Eigen::Isometry3d& X = scene.sheets[k].X_CK;
        if (tag.id != scene.ids[k] || std::abs(X.linear()(2, 2)) > 0.94) continue;
        // Two tags in a scene may have the same id.
        if ((Middle(tag.corners_px) - Middle(scene.corners[k])).norm() > 6) continue;
        const auto poses = vision::PosesOfTag(lens, tag.corners_px, tag.covariance, scene.side_m);
        if (!poses) continue;
        if (poses->ambiguous()) ++ambiguous;
        const Pose& found = poses->best.X_CK;
        flips += Eigen::AngleAxisd(found.R.transpose() * X.linear()).angle() > 0.2 ? 1 : 0;
        const Vec3 error = found.p - X.translation();
        const Mat3 covariance = poses->best.covariance.topLeftCorner<3, 3>();
        squares += error.squaredNorm();
        bound += covariance.trace();
        whitened += error.dot(covariance.ldlt().solve(error)) / 3;
        ++count;
      }
    }
  }
  fmt::print("Single tags of 80 mm, {}: z spread {:.2f} (1 +- {:.2f}), {} flips, {} ambiguous\n",
             count, std::sqrt(whitened / count), SigmaOfSpread(count), flips, ambiguous);
  bench::Report({.what = "position of a single tag of 80 mm, RMS",
                 .ours = 1e3 * std::sqrt(squares / count),
                 .unit = "mm",
                 .goal = bench::RatioAtMost(1.2),
                 .peer = "limit: covariance of its corners",
                 .peers = 1e3 * std::sqrt(bound / count),
                 .timed = false});
}

/// Worst time over adversarial frames: noise, checkers of every size, bars, random blocks.
void SlowFrames(int frames) {
  vision::TagDetector detector(*target::TagFamilyOfName("36h11"), {});
  std::mt19937_64 random(9);
  std::vector<std::uint8_t> grey(std::size_t{1920} * 1080);
  double worst = 0;
  int limited = 0;
  for (int frame = 0; frame < frames; ++frame) {
    const int block = 1 + static_cast<int>(random() % 40), kind = frame % 4;
    const std::uint64_t seed = random();
    for (int v = 0; v < 1080; ++v) {
      for (int u = 0; u < 1920; ++u) {
        std::uint64_t h = seed ^ (static_cast<std::uint64_t>(u / block) << 32) ^
                          static_cast<std::uint64_t>(v / block);
        h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9ULL;
        grey[static_cast<std::size_t>(v) * 1920 + u] = static_cast<std::uint8_t>(
            kind == 0   ? h >> 56
            : kind == 1 ? ((u / block + v / block) % 2 == 0 ? 0U : 255U)
            : kind == 2 ? (u % (3 * block) < 2 * block && v % (3 * block) < 2 * block ? 0U : 255U)
                        : 255 * (h >> 63));
      }
    }
    vision::SeenTags seen;
    const double start = bench::CpuTime_ms();
    detector.Detect({grey.data(), 1920, 1080, 1920}, nullptr, seen);
    worst = std::max(worst, bench::CpuTime_ms() - start);
    limited += seen.limited ? 1 : 0;
  }
  fmt::print("Adversarial frames: {} of {} with regions skipped\n", limited, frames);
  bench::Report({.what = fmt::format("tags of an adversarial frame, longest of {}", frames),
                 .ours = worst,
                 .unit = "ms",
                 .goal = bench::AtMost(200)});
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Effort effort = bench::EffortFrom(argc, argv);
  const int scenes = bench::Choose(effort, 1, 2, 10), times = bench::Choose(effort, 1, 3, 5);
  fmt::print("Six 36h11 tags, 1920 x 1080, one core; ratio to the time of AprilTag\n\n");
  fmt::print(
      "| scene | detector | ms | ratio | found | corner RMSE px |\n|---|---|---|---|---|---|\n");
  SixTagScenes("90 px", {}, 90, scenes, times);
  renderer::Conditions dim;
  dim.black = 100;
  dim.white = 100 + 0.08 * 255;
  dim.background = 108;
  SixTagScenes("contrast 0.08, noise", dim, 90, scenes, times);
  SixTagScenes("small, 30 px", {}, 30, scenes, times);
  SmallTags(bench::Choose(effort, 1, 4, 20), times, bench::Choose(effort, 1, 7, 7));
  NaturalImages(bench::Choose(effort, 1, 6, 200));
  TipOfBody(bench::Choose(effort, 2, 40, 200));
  SingleTags(bench::Choose(effort, 1, 10, 100));
  SlowFrames(bench::Choose(effort, 1, 40, 1000));
}
