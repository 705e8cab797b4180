// Captures that go wrong are refused with their true cause; good ones are accepted.
#include "app/vision/lens/capture_diagnosis.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>

#include "app/vision/lens/calibration.h"
#include "app/vision/lens/calibration_reasons.h"
#include "app/vision/lens/lens_json.h"
#include "app/vision/lens/rival_fit.h"
#include "tests/app/vision/lens/rendered_views.h"
#include "tests/app/vision/lens/stated_camera.h"
#include "tests/lens_captures/capture_maker.h"

namespace plumbline::capture_diagnosis_test {

using namespace plumbline::vision;
using namespace plumbline::lens_captures;

namespace {

/// @param error_px  receives the largest true error within the usable region
LensCalibration CalibrationOf(const std::string& name, std::uint64_t seed,
                              double* error_px = nullptr, const CalibrationOptions& options = {}) {
  for (const Kind& kind : AllKinds()) {
    if (kind.name != name) continue;
    Random random(seed);
    Conditions conditions = GoodConditions(random);
    kind.prepare(conditions, random);
    const SimulatedCapture capture = Simulate(conditions, random);
    const LensCalibration c = CalibrateLens(conditions.board, capture.views,
                                            {conditions.width, conditions.height}, options);
    if (error_px != nullptr) {
      *error_px = LargestError(conditions.camera, test::StatedCamera(c.lens), conditions.width,
                               conditions.height, c.usable_radius_px);
    }
    return c;
  }
  FAIL("no kind " << name);
  return {};
}

CalibrationOptions Declaring(bool no_window, bool fixed_focus) {
  CalibrationOptions options;
  options.declared = {no_window, fixed_focus};
  return options;
}

std::string ReasonsOf(const LensCalibration& calibration) {
  std::string all;
  for (const auto* lines : {&calibration.reasons, &calibration.notes}) {
    for (const std::string& line : *lines) all += line + "\n";
  }
  return all;
}

}  // namespace

TEST_CASE("one linear step predicts the fit of a rival, also from a fit that has parameters") {
  Random random(11);
  const Conditions conditions = GoodConditions(random);
  const SimulatedCapture capture = Simulate(conditions, random);
  const image::ImageSize size{conditions.width, conditions.height};
  const auto fit = FitLens(conditions.board, capture.views, size);
  REQUIRE(fit);
  const ViewConsistency consistency = ConsistencyOf(conditions.board, *fit, capture.views);
  const double noise_px = consistency.noise_px;
  const RivalProblem problem(conditions.board, capture.views, size, *fit, consistency.used,
                             noise_px);
  Rival prism, both;
  prism.global = {kPrism1, kPrism2, kPrism3, kPrism4};
  both.global = {kPrism1, kPrism2, kPrism3, kPrism4, kStretch, kSkew};
  Rival stretch;
  stretch.global = {kStretch, kSkew};
  const RivalResult with_prism = problem.Fit(prism), with_both = problem.Fit(both, with_prism);
  REQUIRE((with_prism.converged && with_both.converged));
  const std::vector<ScoreTest> tests = problem.ScoreTests({{}, stretch}, prism, with_prism);
  REQUIRE(tests.size() == 2);
  CHECK(tests[0].decrease == Approx(0).margin(1e-6));
  CHECK(tests[1].rival.global == both.global);
  const auto cost = [&](const RivalResult& result) {
    return result.square_sum_px2 / (noise_px * noise_px) + result.prior_chi2;
  };
  CHECK(tests[1].decrease == Approx(cost(with_prism) - cost(with_both)).epsilon(0.05).margin(0.1));
  CHECK(tests[1].result.extra[kStretch] ==
        Approx(with_both.extra[kStretch]).epsilon(0.05).margin(1e-6));
  CHECK(tests[1].result.shared[kFx] == Approx(with_both.shared[kFx]).margin(0.05));
  // The covariance is that of the fit with these parameters.
  const RivalPrecision precision = problem.PrecisionOf(both, with_both);
  CHECK(tests[1].covariance(kFx, kFx) == Approx(precision.covariance(kFx, kFx)).epsilon(0.05));
}

TEST_CASE("correlated residuals count as less evidence, the effect itself does not") {
  const auto tested = [](double haze_px, double stretch) {
    Random random(12);
    Conditions conditions = GoodConditions(random);
    conditions.print_noise_m = 0;
    conditions.deform = [stretch](int, const Vector3d& p) {
      return Vector3d((1 + stretch) * p.x(), p.y(), p.z());
    };
    SimulatedCapture capture = Simulate(conditions, random);
    for (std::size_t j = 0; j < capture.views.size(); ++j) {
      for (lens::Vec2& p : capture.views[j].corners_px) {
        const double phase = 2.4 * static_cast<double>(j);
        p += haze_px * lens::Vec2(std::sin(phase + p.y() / 60), std::cos(phase + p.x() / 70));
      }
    }
    const image::ImageSize size{conditions.width, conditions.height};
    const auto fit = FitLens(conditions.board, capture.views, size);
    REQUIRE(fit);
    const RivalProblem problem(conditions.board, capture.views, size, *fit,
                               ConsistencyOf(conditions.board, *fit, capture.views).used,
                               conditions.noise_px);
    Rival stretched, zoom;
    stretched.global = {kStretch, kSkew};
    zoom.local = {kZoom};
    return problem.ScoreTests({stretched, zoom}, {}, problem.Fit({}));
  };
  const auto good = tested(0, 0), haze = tested(0.2, 0), stretch = tested(0, 0.002);
  CHECK(good[0].score_dispersion == Approx(1).margin(0.7));
  CHECK(good[1].smooth_dispersion == Approx(1).margin(0.3));
  CHECK(haze[0].score_dispersion > 4);
  CHECK(haze[1].smooth_dispersion > 4);
  CHECK(stretch[0].decrease > 100);
  CHECK(stretch[0].score_dispersion < 2);
}

TEST_CASE("a refusal states the uncertainty that its cause leaves, and that much is accepted") {
  constexpr const char* kWords = "the projection would be uncertain by ";
  int stated = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    CalibrationOptions options;
    const LensCalibration refused = CalibrationOf("window pane, parallel", seed, nullptr, options);
    const std::string reasons = ReasonsOf(refused);
    const std::size_t at = reasons.find(kWords);
    if (refused.accepted || at == std::string::npos) continue;
    ++stated;
    options.acceptable_px = std::stod(reasons.substr(at + std::strlen(kWords)));
    INFO("seed " << seed << "\n" << reasons);
    CHECK(CalibrationOf("window pane, parallel", seed, nullptr, options).accepted);
  }
  CHECK(stated >= 2);
}

TEST_CASE("a zoom that jumps before the last frames is refused, and the frame is named") {
  for (const char* name : {"zoom jumps before the last 2", "zoom jumps before the last 3"}) {
    const LensCalibration c = CalibrationOf(name, 3);
    INFO(name << "\n" << ReasonsOf(c));
    CHECK_FALSE(c.accepted);
    CHECK_FALSE(c.further_views_help);
    CHECK(ReasonsOf(c).find("the focal length changed by") != std::string::npos);
    CHECK(ReasonsOf(c).find("between view") != std::string::npos);
  }
}

TEST_CASE("a board that moves under a rolling shutter is not a moved lens") {
  for (const char* name : {"rolling shutter, speeds differ", "rolling shutter, only some frames"}) {
    const LensCalibration c = CalibrationOf(name, 5);
    INFO(name << "\n" << ReasonsOf(c));
    CHECK_FALSE(c.accepted);
    CHECK(ReasonsOf(c).find("rolling shutter") != std::string::npos);
    CHECK(ReasonsOf(c).find("lens moved") == std::string::npos);
  }
}

TEST_CASE("a window is named, tilted or not, or the stated uncertainty includes its effect") {
  // Parallel windows hardly show: one of these is beyond three claimed standard deviations, which
  // the evaluation counts as a false acceptance (tests/lens_captures/README.md).
  int named = 0, beyond = 0;
  for (const char* name : {"window pane, parallel", "window pane, tilted"}) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      double error_px = 0;
      const LensCalibration c = CalibrationOf(name, seed, &error_px);
      INFO(name << ", seed " << seed << ", error " << error_px << " px, claimed "
                << c.uncertainty.max_px << " px\n"
                << ReasonsOf(c));
      if (c.accepted) CHECK(error_px < std::max(0.3, 4 * c.uncertainty.max_px));
      beyond += c.accepted && error_px > std::max(0.3, 3 * c.uncertainty.max_px);
      named += ReasonsOf(c).find("window") != std::string::npos;
    }
  }
  CHECK(named >= 8);
  CHECK(beyond <= 1);
}

TEST_CASE("a focal length that may vary is named, and its constancy can be declared") {
  Random random(17);
  Conditions conditions = GoodConditions(random);
  conditions.views = 12;
  conditions.noise_px = 0.05;
  conditions.max_tilt_rad = 0.4;
  conditions.camera.fx = conditions.camera.fy = 0.6 * conditions.width;
  conditions.camera.k[0] = -0.05, conditions.camera.k[1] = 0;
  const SimulatedCapture capture = Simulate(conditions, random);
  const auto calibrate = [&](const CalibrationOptions& options) {
    return CalibrateLens(conditions.board, capture.views, {conditions.width, conditions.height},
                         options);
  };
  const LensCalibration open = calibrate({});
  CalibrationOptions options;
  options.declared.fixed_focus = true;
  const LensCalibration declared = calibrate(options);
  const std::string reasons = ReasonsOf(open);
  INFO(reasons << ReasonsOf(declared) << open.uncertainty.max_px);
  CHECK_FALSE(open.accepted);
  CHECK(open.further_views_help);
  CHECK(reasons.find("acceptable: a focal length that varies from frame to frame by 0.4 % is not "
                     "excluded (probability 0.56): if the camera has neither autofocus nor") !=
        std::string::npos);
  CHECK(reasons.find("declare it (--fixed-focus, or fixed_focus in [camera])") !=
        std::string::npos);
  CHECK(declared.accepted);
  CHECK(declared.uncertainty.max_px < open.uncertainty.max_px);
  const double error_px =
      LargestError(conditions.camera, test::StatedCamera(declared.lens), conditions.width,
                   conditions.height, declared.usable_radius_px);
  CHECK(error_px < 3 * declared.uncertainty.max_px);
}

TEST_CASE("a window that is not excluded is named, with the way to exclude it") {
  const LensCalibration open = CalibrationOf("window pane, parallel", 26);
  const std::string reasons = ReasonsOf(open);
  INFO(reasons);
  CHECK_FALSE(open.accepted);
  CHECK(reasons.find("a pane of glass in front of the lens is not excluded (probability 0.") !=
        std::string::npos);
  CHECK(reasons.find("if there is none, declare it (--no-window, or no_window in [camera]); "
                     "otherwise take views at different distances") != std::string::npos);
  CHECK(reasons.find("looks through a window") == std::string::npos);  // that is not shown
  const LensCalibration declared =
      CalibrationOf("window pane, parallel", 26, nullptr, Declaring(true, false));
  CHECK(declared.everywhere_px < open.everywhere_px);
}

TEST_CASE("an effect that is declared absent but likely is said to contradict the declaration") {
  const std::vector<UnprovedEffect> likely{{CaptureCause::kWindowPane, 0.9999, 0, {}}};
  CHECK(UnprovedAdvice(likely, Declaring(true, false).declared) ==
        "a pane of glass in front of the lens is likely (probability 0.99), contrary to the "
        "declaration (no_window): take views at different distances");
}

TEST_CASE("a declaration that the corners contradict does not help, and the answer says so") {
  const LensCalibration window =
      CalibrationOf("window pane, tilted", 1, nullptr, Declaring(true, false));
  INFO(ReasonsOf(window));
  CHECK_FALSE(window.accepted);
  CHECK(ReasonsOf(window).find("contrary to the declaration (no_window)") != std::string::npos);
  const LensCalibration varies =
      CalibrationOf("autofocus breathes", 1, nullptr, Declaring(false, true));
  INFO(ReasonsOf(varies));
  CHECK_FALSE(varies.accepted);
  CHECK(ReasonsOf(varies).find("contrary to the declaration (fixed_focus)") != std::string::npos);
}

TEST_CASE("an explanation that contains a better one is not its rival") {
  const LensCalibration c = CalibrationOf("principal point jumps", 4);
  INFO(ReasonsOf(c));
  CHECK_FALSE(c.accepted);
  CHECK(ReasonsOf(c).find("the principal point moved by") != std::string::npos);
  CHECK(ReasonsOf(c).find("not clear") == std::string::npos);
}

TEST_CASE("the times of the views decide which one is the last") {
  Random random(6);
  const Conditions conditions = GoodConditions(random);
  SimulatedCapture capture = Simulate(conditions, random);
  const image::ImageSize size{conditions.width, conditions.height};
  const LensCalibration in_order = CalibrateLens(conditions.board, capture.views, size);
  std::shuffle(capture.views.begin(), capture.views.end(), random);
  const LensCalibration shuffled = CalibrateLens(conditions.board, capture.views, size);
  CHECK(in_order.accepted);
  CHECK(shuffled.accepted);
  CHECK(shuffled.frames_used == in_order.frames_used);
}

TEST_CASE("each cause wins against its rivals where they come close to it") {
  struct Case {
    const char* name;
    std::uint64_t seed;
    const char* words;  // of the reason
  };
  const Case cases[] = {
      // One view hardly separates the two ways in which a lens moves; that it moved is certain.
      {"zoom jumps before the last 1", 3416562091400207425, "the lens moved while"},
      // Without the focal length, which does not change, three shifts are simpler than a shutter.
      {"image stabilisation shifts", 18266951925373848602U,
       "the principal point varies from frame"},
      // The stretch takes more than twelve steps to fit.
      {"squares declared wrong: not square", 5160800979863669372, "the print is stretched by -7.7"},
      // What zoom and shift explain is less than what they leave.
      {"heat haze", 12142521818127880069U, "hot air"},
  };
  for (const Case& c : cases) {
    const LensCalibration calibration = CalibrationOf(c.name, c.seed);
    INFO(c.name << "\n" << ReasonsOf(calibration));
    CHECK_FALSE(calibration.accepted);
    CHECK(ReasonsOf(calibration).find(c.words) != std::string::npos);
    CHECK(ReasonsOf(calibration).find("not clear") == std::string::npos);
  }
}

TEST_CASE("a step in the print, which no smooth function describes, is estimated with the lens") {
  double error_px = 0;
  const LensCalibration c =
      CalibrationOf("two sheets joined with a gap", 2233864649520366291, &error_px);
  INFO(ReasonsOf(c));
  CHECK(c.accepted);
  CHECK(error_px < 3 * c.uncertainty.max_px);
}

TEST_CASE("a board that is not as declared is named as such") {
  for (const auto& [name, words] : {std::pair("print stretched along its rows", "stretched by"),
                                    {"board S-shaped", "not flat"},
                                    {"paper held in the hand", "the board bends"}}) {
    double error_px = 0;
    const LensCalibration c = CalibrationOf(name, 8, &error_px);
    INFO(name << "\n" << ReasonsOf(c));
    CHECK(ReasonsOf(c).find(words) != std::string::npos);
    if (c.accepted) CHECK(error_px < 3 * c.uncertainty.max_px);
    CHECK(ReasonsOf(c).find("lens moved") == std::string::npos);
  }
}

TEST_CASE("fisheye, rational and thin prism lenses are recognized and estimated") {
  for (const auto& [name, model] : {std::pair("fisheye, 130 degrees", lens::LensModel::kFisheye),
                                    {"fisheye, moderate", lens::LensModel::kFisheye},
                                    {"thin prism", lens::LensModel::kThinPrism}}) {
    double error_px = 0;
    const LensCalibration c = CalibrationOf(name, 2, &error_px);
    INFO(name << "\n"
              << ReasonsOf(c) << "error " << error_px << ", stated " << c.uncertainty.max_px);
    CHECK(c.accepted);
    CHECK(lens::ModelOf(c.lens) == model);
    CHECK(error_px < 3 * c.uncertainty.max_px);
    const auto file = LensFromJson(LensJson(c));
    REQUIRE(file);
    CHECK(lens::VectorOfLens(file->lens) == lens::VectorOfLens(c.lens));
    CHECK(file->lens.fisheye == c.lens.fisheye);
    CHECK(file->covariance.isApprox(c.covariance, 1e-12));
    CHECK(file->usable_radius_px == c.usable_radius_px);
  }
}

TEST_CASE("a lens seen in the middle of the image only is accepted for that region") {
  const target::Board board;
  const image::ImageSize size{1920, 1080};
  auto views = NoisyViews(DrawViews({}, board, 3), board, 0.03, 3);
  REQUIRE(lens::UsableEverywhere(CalibrateLens(board, views, size)));
  for (BoardView& view : views) {
    for (std::size_t k = 0; k < view.seen.size(); ++k)
      view.seen[k] = (view.corners_px[k] - lens::MiddleOf(size)).norm() < 720;
  }
  const LensCalibration c = CalibrateLens(board, views, size);
  INFO(ReasonsOf(c));
  CHECK(c.accepted);
  CHECK_FALSE(lens::UsableEverywhere(c));
  CHECK(lens::UsableShare(c) >= 0.5);
  REQUIRE_FALSE(c.notes.empty());
  CHECK(c.notes.front().find("usable up to") == 0);
  CHECK(c.everywhere_px > CalibrationOptions{}.acceptable_px);
  CHECK(c.uncertainty.max_px <= CalibrationOptions{}.acceptable_px);
  const lens::Lens truth = test::LensOfCamera(renderer::ZoomLens(1700));
  CHECK(LargestDifference(truth, c.lens, size, std::nullopt, c.usable_radius_px) <
        3 * c.uncertainty.max_px);
  CHECK(LensFromJson(LensJson(c))->usable_radius_px == c.usable_radius_px);
}

TEST_CASE("a print that is skewed and also a little uneven is named by what displaces it most") {
  int skewed = 0, uneven_only = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const std::string reasons = ReasonsOf(CalibrationOf("print skewed", seed));
    skewed += reasons.find("the print is skewed by") != std::string::npos;
    uneven_only += reasons.find("the print is uneven") == 0;
  }
  CHECK(skewed >= 2);
  CHECK(uneven_only == 0);
}

TEST_CASE("hot air is not a board that bent") {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const LensCalibration c = CalibrationOf("heat haze", seed);
    INFO(ReasonsOf(c));
    if (!c.accepted) CHECK(ReasonsOf(c).find("board bent") == std::string::npos);
  }
}

TEST_CASE("repeated frames count once") {
  const LensCalibration c = CalibrationOf("every frame delivered three times", 4);
  INFO(ReasonsOf(c));
  CHECK(c.frames_used.size() <= 11);
  CHECK(c.frames_refused.size() >= 13);
  CHECK(c.frames_refused[0].reason.find("repeats an earlier frame") == 0);
}

TEST_CASE("frames that cannot be used at the end leave the lens unknown") {
  const target::Board board;
  const image::ImageSize size{1920, 1080};
  auto views = NoisyViews(DrawViews({}, board, 3), board, 0.03, 3);
  REQUIRE(CalibrateLens(board, views, size).accepted);
  views.back().blur_px = 8;
  const LensCalibration c = CalibrateLens(board, views, size);
  INFO(ReasonsOf(c));
  CHECK_FALSE(c.accepted);
  CHECK(c.further_views_help);
  CHECK(ReasonsOf(c).find("the last frame") != std::string::npos);
}

}  // namespace plumbline::capture_diagnosis_test
