#include "app/vision/camera/reference_tags.h"

#include <catch2/catch.hpp>

#include "app/vision/camera/tag_fit.h"
#include "tests/app/vision/camera/reference_tag_scene.h"

namespace plumbline::reference_tags_test {

using namespace plumbline::vision;
using namespace plumbline::test;

namespace {

constexpr double kNoise_px = 0.05;
constexpr int kSeeds = 200;
const TagCheckSettings kNoFloor{2e-4, 0};

/// Reference tags whose declared places are wrong by `place_sd_m`, and the baseline from a first
/// image.
struct Scene {
  target::Body declared = CellTags();
  target::Body real = declared;
  Pose X_CK = CellInCamera();
  lens::KnownLens lens{TagSceneLens(), lens::LensCovariance::Zero()};
  TagBaseline baseline;
  std::uint64_t seed;

  explicit Scene(std::uint64_t number, double place_sd_m = 2e-4) : seed(number) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> wrong(0, place_sd_m);
    for (target::BodyTag& tag : real.tags) {
      tag.X_KM.p += Vec3(wrong(random), wrong(random), wrong(random));
    }
    baseline = BaselineAt(lens, declared, See(lens.lens, X_CK, 1), X_CK);
  }
  std::vector<vision::SeenTag> See(const lens::Lens& now, const Pose& X,
                                   std::uint64_t check) const {
    return ObserveTags(now, real, X, kNoise_px, 1000 * seed + check);
  }
  TagTestResult Judge(const std::vector<vision::SeenTag>& seen) const {
    return TestReferenceTags(lens, declared, seen, &baseline, kNoFloor);
  }
};

}  // namespace

TEST_CASE("tags that did not move are good, and chi^2 follows from the noise") {
  double chi2 = 0;
  int degrees_of_freedom = 0, not_good = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Scene scene(seed);
    const TagTestResult judgement = scene.Judge(scene.See(scene.lens.lens, scene.X_CK, 2));
    not_good += judgement.verdict != TagTestOutcome::kGood ? 1 : 0;
    chi2 += judgement.chi2;
    degrees_of_freedom += judgement.degrees_of_freedom;
  }
  CHECK(not_good == 0);
  CHECK(chi2 / degrees_of_freedom == Approx(1).epsilon(0.05));
}

TEST_CASE("a zoom drift is recognized; its size is within its stated uncertainty") {
  double squares = 0;
  int others = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Scene scene(seed);
    const double share = (seed % 2 == 0 ? 1 : -1) * 1e-3;
    const TagTestResult judgement =
        scene.Judge(scene.See(Zoomed(scene.lens.lens, share), scene.X_CK, 2));
    others += judgement.verdict != TagTestOutcome::kZoomDrifted ? 1 : 0;
    const double z = (judgement.log_focal - std::log1p(share)) / judgement.log_focal_sd;
    squares += z * z;
    const lens::KnownLens drifted =
        WithFocalDrift(scene.lens, judgement.log_focal, judgement.log_focal_sd);
    CHECK(drifted.lens.fx == Approx(scene.lens.lens.fx * (1 + share)).epsilon(3e-4));
    CHECK(std::sqrt(drifted.covariance(0, 0)) ==
          Approx(drifted.lens.fx * judgement.log_focal_sd).epsilon(1e-9));
  }
  CHECK(others == 0);
  CHECK(std::sqrt(squares / kSeeds) == Approx(1).epsilon(0.15));
}

TEST_CASE("a moved camera is recognized, with its new pose") {
  int others = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Scene scene(seed);
    const Pose step{RotationFromVector(Vec3(0.002, -0.001, 0.0015)), Vec3(0.001, 0.002, -0.001)};
    const Pose X = step * scene.X_CK;
    const TagTestResult judgement = scene.Judge(scene.See(scene.lens.lens, X, 2));
    others += judgement.verdict != TagTestOutcome::kCameraMoved ? 1 : 0;
    CHECK(vision::AngleBetween(judgement.X_CK, X) < 5e-4);
    CHECK((judgement.X_CK.p - X.p).norm() < 1e-3);
    CHECK(judgement.turned_rad == Approx(std::sqrt(7.25e-6)).epsilon(0.2));
  }
  CHECK(others <= 2);
}

TEST_CASE("neither a moved camera nor a zoom drift: bad") {
  const Pose step{RotationFromVector(Vec3(0.002, -0.001, 0.0015)), Vec3(0.001, 0.002, -0.001)};
  int accepted = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Scene scene(seed);
    const TagTestResult both =
        scene.Judge(scene.See(Zoomed(scene.lens.lens, 0.01), step * scene.X_CK, 2));
    accepted += both.verdict != TagTestOutcome::kBad ? 1 : 0;
    lens::Lens warped = scene.lens.lens;
    warped.k1 += 0.08;
    accepted +=
        scene.Judge(scene.See(warped, scene.X_CK, 3)).verdict != TagTestOutcome::kBad ? 1 : 0;
  }
  CHECK(accepted == 0);
}

TEST_CASE("one displaced tag is excluded and named") {
  for (int seed = 1; seed <= 20; ++seed) {
    Scene scene(seed);
    scene.real.tags[3].X_KM.p += Vec3(0.004, -0.002, 0);
    const TagTestResult judgement = scene.Judge(scene.See(scene.lens.lens, scene.X_CK, 2));
    CHECK(judgement.verdict == TagTestOutcome::kGood);
    CHECK(judgement.excluded == std::vector<int>{3});
  }
}

TEST_CASE("several displaced tags are excluded and named, as long as a majority agrees") {
  for (int seed = 1; seed <= 20; ++seed) {
    Scene scene(seed);
    scene.real.tags[1].X_KM.p += Vec3(-0.05, 0.02, 0);
    scene.real.tags[3].X_KM.p += Vec3(0.004, -0.002, 0.01);
    const auto seen = scene.See(scene.lens.lens, scene.X_CK, 2);
    for (const bool known : {false, true}) {
      const TagTestResult judgement = TestReferenceTags(
          scene.lens, scene.declared, seen, known ? &scene.baseline : nullptr, kNoFloor);
      CHECK(judgement.verdict == TagTestOutcome::kGood);
      CHECK(judgement.excluded == std::vector<int>{1, 3});
    }
    scene.real.tags[2].X_KM.p += Vec3(0.02, 0.03, 0);
    const TagTestResult judgement = TestReferenceTags(
        scene.lens, scene.declared, scene.See(scene.lens.lens, scene.X_CK, 3), nullptr, kNoFloor);
    CHECK(judgement.verdict == TagTestOutcome::kBad);
    CHECK(judgement.unresolved == std::vector<int>{0, 1, 2, 3, 4});
  }
}

TEST_CASE("a tag that was excluded from the baseline remains excluded until it is put back") {
  Scene scene(7);
  const target::Body right = scene.real;
  scene.real.tags[3].X_KM.p += Vec3(0.03, 0, 0);
  const auto first = scene.See(scene.lens.lens, scene.X_CK, 2);
  const TagTestResult start =
      TestReferenceTags(scene.lens, scene.declared, first, nullptr, kNoFloor);
  REQUIRE(start.excluded == std::vector<int>{3});
  scene.baseline = BaselineAt(scene.lens, scene.declared, first, start.X_CK);
  scene.baseline.tags.erase(3);
  const TagTestResult later = scene.Judge(scene.See(scene.lens.lens, scene.X_CK, 3));
  CHECK(later.verdict == TagTestOutcome::kGood);
  CHECK(later.excluded == std::vector<int>{3});
  scene.real = right;
  CHECK(scene.Judge(scene.See(scene.lens.lens, scene.X_CK, 4)).excluded.empty());
}

TEST_CASE("tags turned by half a turn, as OpenCV draws 36h11, are recognized") {
  for (int seed = 1; seed <= 20; ++seed) {
    const Scene scene(seed);
    const auto upright = scene.See(scene.lens.lens, scene.X_CK, 2);
    auto turned = upright;
    for (vision::SeenTag& tag : turned) tag = Turned(tag, 2);
    for (const bool known : {false, true}) {
      const TagTestResult all = TestReferenceTags(scene.lens, scene.declared, turned,
                                                  known ? &scene.baseline : nullptr, kNoFloor);
      CHECK(all.verdict == TagTestOutcome::kBad);
      CHECK(all.all_turned);
    }
    const TagTestResult two =
        TestReferenceTags(scene.lens, scene.declared, {turned[0], turned[3]}, nullptr, kNoFloor);
    CHECK(two.all_turned);
    auto one = upright;
    one[2] = turned[2];
    const TagTestResult single =
        TestReferenceTags(scene.lens, scene.declared, one, nullptr, kNoFloor);
    CHECK(single.verdict == TagTestOutcome::kGood);
    CHECK(single.excluded == std::vector<int>{2});
    CHECK(single.quarter_turns == std::map<int, int>{{2, 2}});
  }
}

TEST_CASE("tags that are not visible") {
  const Scene scene(1);
  auto seen = scene.See(scene.lens.lens, scene.X_CK, 2);
  CHECK(scene.Judge({}).verdict == TagTestOutcome::kNotVisible);
  CHECK(TestReferenceTags(scene.lens, scene.declared, {seen[0]}, nullptr).verdict ==
        TagTestOutcome::kNotVisible);
  CHECK(scene.Judge({seen[0]}).verdict == TagTestOutcome::kGood);
  CHECK(scene.Judge({seen[0], seen[0]}).verdict == TagTestOutcome::kNotVisible);  // an ambiguous id
  seen[0].corners_px.fill(lens::Vec2(NAN, NAN));
  CHECK(scene.Judge(seen).verdict == TagTestOutcome::kNotVisible);
}

TEST_CASE("without a baseline, placement errors and lens uncertainty are taken into account") {
  int wrong_good = 0, right_bad = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const Scene scene(seed);
    const auto judge = [&](const lens::Lens& now) {
      return TestReferenceTags(scene.lens, scene.declared, scene.See(now, scene.X_CK, 2), nullptr,
                               kNoFloor)
          .verdict;
    };
    right_bad += judge(scene.lens.lens) != TagTestOutcome::kGood ? 1 : 0;
    wrong_good += judge(Zoomed(scene.lens.lens, 0.05)) == TagTestOutcome::kGood ? 1 : 0;
  }
  CHECK(right_bad == 0);
  CHECK(wrong_good == 0);
}

TEST_CASE("an interpolated lens gets its focal length from the tags, weighed against its prior") {
  constexpr double kPrior = 0.02;
  double squares = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    Scene scene(seed);
    std::mt19937_64 random(77 * seed);
    std::normal_distribution<double> error(0, kPrior);
    const lens::Lens truth = Zoomed(scene.lens.lens, error(random));
    scene.lens.covariance.topLeftCorner<2, 2>().setConstant(std::pow(kPrior * truth.fx, 2));
    const auto refined = RefineFocalLength(scene.lens, kPrior, scene.declared,
                                           scene.See(truth, scene.X_CK, 2), kNoFloor);
    REQUIRE(refined);
    const double sd = std::sqrt(refined->covariance(0, 0));
    CHECK(sd < 0.5 * kPrior * truth.fx);
    const double z = (refined->lens.fx - truth.fx) / sd;
    squares += z * z;
  }
  CHECK(std::sqrt(squares / kSeeds) == Approx(1).epsilon(0.2));
}

TEST_CASE("rendered frames through the detector: no false alarm, and a drift is recognized") {
  const auto family = target::TagFamilyOfName("36h11").value();
  const target::Body cell = CellTags();
  const renderer::Camera camera = renderer::ZoomLens(2600);
  const lens::KnownLens lens{LensOfCamera(camera), lens::LensCovariance::Zero()};
  const Pose X = CellInCamera();
  const auto check = [&](const renderer::Camera& through, std::uint64_t seed) {
    std::vector<renderer::Sheet> sheets;
    for (const target::BodyTag& tag : cell.tags) {
      const Pose X_CM = X * tag.X_KM;
      Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
      place.linear() = X_CM.R;
      place.translation() = X_CM.p;
      sheets.push_back(TagSheet(family, tag.id, tag.side_m, place));
    }
    renderer::Conditions light;
    light.shade_x = 0.1 * static_cast<double>(seed % 3);
    light.blur_px = 0.7 + 0.1 * static_cast<double>(seed % 4);
    const renderer::Image image = renderer::Render(through, sheets, light, seed);
    vision::TagDetector detector(family, {});
    vision::SeenTags seen;
    detector.Detect(ViewOf(image), &lens.lens, seen);
    return seen.tags;
  };
  const auto first = check(camera, 1);
  REQUIRE(first.size() == cell.tags.size());
  const TagTestResult start = TestReferenceTags(lens, cell, first, nullptr);
  REQUIRE(start.verdict == TagTestOutcome::kGood);
  const TagBaseline baseline = BaselineAt(lens, cell, first, start.X_CK);
  double chi2 = 0, degrees_of_freedom = 0;
  for (std::uint64_t seed = 2; seed < 26; ++seed) {
    const TagTestResult judgement = TestReferenceTags(lens, cell, check(camera, seed), &baseline);
    CHECK(judgement.verdict == TagTestOutcome::kGood);
    chi2 += judgement.chi2;
    degrees_of_freedom += judgement.degrees_of_freedom;
  }
  CHECK(chi2 / degrees_of_freedom < 1.1);
  renderer::Camera drifted = camera;
  drifted.fx *= 1.001;
  drifted.fy *= 1.001;
  const TagTestResult judgement = TestReferenceTags(lens, cell, check(drifted, 30), &baseline);
  CHECK(judgement.verdict == TagTestOutcome::kZoomDrifted);
  CHECK(judgement.log_focal == Approx(1e-3).margin(4 * judgement.log_focal_sd));
}

}  // namespace plumbline::reference_tags_test
