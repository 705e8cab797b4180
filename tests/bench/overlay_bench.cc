// Benchmark of the overlay registration in a scene whose ground truth shares no code with the
// product: the physics of the virtual cell place a tagged plate on the loaded arm, and the truth
// renderer draws it and the reference tags through a distorted lens. From the image on the
// product's own code is used: tags, cell pose, loaded arm, bent mesh in the vertex shader,
// undistorted background. Errors in the drawn picture:
//   - corners of the mesh against the truth;
//   - the same without deflection: the error of an overlay that ignores loads;
//   - corners in the undistorted background against the truth.
#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <random>

#include "app/display/view/overlay.h"
#include "app/vision/tracking/tracker.h"
#include "drivers/display/renderer.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/vision/tracking/tag_scene.h"
#include "tests/bench/rows.h"
#include "tests/virtual_cell/world.h"

using namespace plumbline;

namespace {

constexpr double kDistance_m = 1.5, kFocal_px = 1700, kSide_m = 0.12;
constexpr int kPlateTag = 40;
const Vec3 kPlate_T(0.05, -0.04, 0.0);  ///< centre of the tag, on a plate at the tip

/// Reference tags of 120 mm around the field of view at different depths.
target::Body ReferenceTags() {
  const Vec3 places[] = {{-0.55, -0.28, 0.00}, {0.55, -0.26, 0.20}, {0.52, 0.28, 0.02},
                         {-0.54, 0.27, 0.18},  {0.00, -0.30, 0.30}, {-0.1, 0.30, 0.25}};
  target::Body cell{"cell", {}};
  for (int k = 0; k < 6; ++k) {
    cell.tags.push_back(
        {k,
         kSide_m,
         {RotationFromRollPitchYaw(Vec3(0.15 * k - 0.3, 0.3 - 0.1 * k, 0)), places[k]}});
  }
  return cell;
}

Eigen::Isometry3d Isometry(const Pose& X) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = X.R;
  isometry.translation() = X.p;
  return isometry;
}

struct Rms {
  double squares = 0, largest = 0;
  int count = 0;
  void Add(const lens::Vec2& off) {
    squares += off.squaredNorm();
    largest = std::max(largest, off.norm());
    ++count;
  }
  double px() const { return count > 0 ? std::sqrt(squares / count) : NAN; }
};

struct Results {
  Rms overlay, unloaded, background;
  double deflection_m = 0, compose_s = 0;
  int scenes = 0, lost = 0;
};

/// One posture, one image.
class Scene {
 public:
  Scene(const cell::ViewModel& model, const virtual_cell::World& world, std::uint64_t seed)
      : model_(model), random_(seed), time_s_(static_cast<double>(seed)) {
    std::uniform_real_distribution<double> u(-1, 1);
    q_.resize(6);
    q_ << 20 * u(random_), -90 + 15 * u(random_), 100 + 15 * u(random_), 30 * u(random_),
        -10 + 20 * u(random_), 40 * u(random_);
    q_ *= kRadPerDeg;
    virtual_cell::WorldInputs now;
    now.q = q_;
    now.payload_kg = payload_kg_ = 40 + 15 * u(random_);
    const virtual_cell::Truth truth = world.Settle(now);
    X_WT_ = {truth.X_WT.linear(), truth.X_WT.translation()};
    // The plate roughly faces the camera, with the x axis of its tag to the right.
    R_TP_ = X_WT_.R.transpose() * kFacing.transpose() *
            RotationFromVector(0.35 * Vec3(u(random_), u(random_), u(random_)));
    X_CW_.R = RotationFromVector(0.1 * Vec3(u(random_), u(random_), u(random_))) * kFacing;
    const Vec3 aim(0.1 * u(random_), 0.08 * u(random_), kDistance_m);
    X_CW_.p = aim - X_CW_.R * (X_WT_ * kPlate_T);
    X_WK_ = Pose{kFacing.transpose(), X_WT_ * kPlate_T + Vec3(0, 0.15, 0)};

    camera_ = renderer::ZoomLens(kFocal_px);
    const target::TagFamily family = target::TagFamilyOfName("36h11").value();
    std::vector<renderer::Sheet> sheets;
    for (const target::BodyTag& tag : ReferenceTags().tags) {
      sheets.push_back(
          test::TagSheet(family, tag.id, tag.side_m, Isometry(X_CW_ * X_WK_ * tag.X_KM)));
    }
    sheets.push_back(test::TagSheet(family, kPlateTag, kSide_m, Isometry(X_CM())));
    image_ = renderer::Render(camera_, sheets, {}, seed);
  }

  void Measure(display::Renderer& renderer, Results& results) {
    cell::ViewModel model = model_;
    model.config.vision.cameras.resize(1);
    model.config.vision.tags.cell = "cell";
    model.config.vision.tags.X_WK = X_WK_;
    target::TagDatabase database;
    database.bodies = {ReferenceTags()};
    vision::Tracker tracker(target::TagFamilyOfName("36h11").value(), database, {});
    lens::KnownLens lens;
    lens.lens = test::LensOfCamera(camera_);
    const vision::TrackedFrame& seen = tracker.Update(test::ViewOf(image_), 0, &lens);
    const auto started = std::chrono::steady_clock::now();
    cell::ViewState state;
    state.now_s = time_s_ + 0.01;
    state.q = q_;
    state.payload_kg = payload_kg_;
    state.payload_cog_F = *model.config.machine.cell.payload_cog_F;
    state.cameras.resize(1);
    state.cameras[0].status.configured = true;
    state.cameras[0].status.state = lens::ZoomState::kValid;
    state.cameras[0].lens = lens.lens;
    state.cameras[0].image =
        cell::ViewImage{0, 1, camera_.width, camera_.height, false, time_s_, 1};
    for (const vision::SeenBody& body : seen.bodies) {
      state.cameras[0].bodies.push_back({body.body->name, body.estimate.X_CK, false});
    }
    ++results.scenes;
    if (state.cameras[0].bodies.empty()) {
      ++results.lost;
      return;
    }
    cell::CarrierTracker memory;
    const cell::Carriers carriers = memory.Update(state, 0, &model, time_s_ + 0.02);
    const int mesh = *renderer.LoadMesh(PlateMesh(model));
    display::ViewFacts facts;
    facts.state = &state;
    facts.carriers = std::span(&carriers, 1);
    facts.model = &model;
    facts.now_s = time_s_ + 0.02;
    cell::ObjectTable table;
    cell::SceneObject plate;
    plate.on.kind = cell::Carrier::Kind::kFlange;
    plate.bends = true;
    table.objects = {plate};
    facts.table = &table;
    display::PictureLayout layout;  // the image fills the picture
    layout.size = {camera_.width, camera_.height};
    layout.image = {0, 0, static_cast<float>(camera_.width), static_cast<float>(camera_.height)};
    scene::DisplayList list;
    display::ImageMarks marks;
    display::AddOverlay({facts, model.config.overlay, {mesh}, {image_.grey.data()}}, 0, layout,
                        list, marks);
    results.compose_s +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    Compare(renderer, list, carriers, results);
    renderer.DropMesh(mesh);
  }

 private:
  static const Mat3 kFacing;  ///< R_CW of a camera looking along the y axis of W

  Pose X_CM() const { return X_CW_ * X_WT_ * Pose{R_TP_, kPlate_T}; }

  /// Corners of the tag in the flange frame of the unloaded tool.
  scene::TriangleMesh PlateMesh(const cell::ViewModel& model) const {
    scene::TriangleMesh mesh;
    for (const Eigen::Vector3d& corner : test::TagCorners(kSide_m)) {
      const Vec3 p_T = R_TP_ * corner + kPlate_T;
      mesh.vertices_O.push_back((model.arm.X_FT().p + p_T).cast<float>());
    }
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
  }

  lens::Vec2 TruePixel(const Eigen::Vector3d& p_C) const {
    renderer::Camera straight = camera_;
    for (double& term : straight.distortion) term = 0;
    return renderer::PixelOf(straight, p_C);
  }

  void Compare(display::Renderer& renderer, const scene::DisplayList& list,
               const cell::Carriers& carriers, Results& results) const {
    const auto corners = test::TagCorners(kSide_m);
    const auto placed = renderer.TransformedVertices(list, list.meshes.at(0));
    const cell::ToolState& tool = *carriers.tool;
    const Pose X_CF_nominal = carriers.world->X_CK * tool.X_WF_nominal;
    const scene::TriangleMesh plate = PlateMesh(model_);
    std::vector<lens::Vec2> truth;
    for (std::size_t k = 0; k < 4; ++k) {
      truth.push_back(TruePixel(Isometry(X_CM()) * corners[k]));
      results.overlay.Add(Project<double>(list.pinhole, placed.at(k).cast<double>()) - truth[k]);
      results.unloaded.Add(
          Project<double>(list.pinhole, X_CF_nominal * Vec3(plate.vertices_O[k].cast<double>())) -
          truth[k]);
    }
    results.deflection_m += (tool.tip_W - tool.tip_nominal_W).norm();

    // The background alone: detect the tag corners in it.
    scene::DisplayList plain = list;
    plain.meshes.clear();
    plain.lines.clear();
    if (renderer.Draw(plain) != display::DrawResult::kDrawn) return;
    const display::RgbImage picture = renderer.ReadBack();
    std::vector<std::uint8_t> grey(picture.rgb.size() / 3);
    for (std::size_t k = 0; k < grey.size(); ++k) grey[k] = picture.rgb[3 * k + 1];
    vision::TagDetector detector(target::TagFamilyOfName("36h11").value(), {});
    vision::SeenTags seen;
    detector.Detect({grey.data(), picture.size.width, picture.size.height, picture.size.width},
                    &list.pinhole, seen);
    for (const vision::SeenTag& tag : seen.tags) {
      if (tag.id != kPlateTag) continue;
      for (std::size_t k = 0; k < 4; ++k) results.background.Add(tag.corners_px[k] - truth[k]);
    }
  }

  const cell::ViewModel& model_;
  std::mt19937_64 random_;
  const double time_s_;  ///< time of the image
  model::JointVector q_;
  double payload_kg_ = 0;
  Pose X_WT_, X_CW_, X_WK_;
  Mat3 R_TP_;
  renderer::Camera camera_;
  renderer::Image image_;
};

const Mat3 Scene::kFacing = (Mat3() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();

}  // namespace

int main(int argc, char** argv) {
  const auto context = display::GlContext::Create();
  if (!context) {
    bench::ReportSkipped("the overlay", context.error());
    return 0;
  }
  const auto renderer = display::Renderer::Create(**context);
  if (!renderer) {
    fmt::print("overlay: not measured: {}\n", renderer.error());
    return 1;
  }
  config::FaultList faults;
  const auto model = cell::ReadViewModel("tests/virtual_cell/demo/plumbline.toml", 0, faults);
  if (!model) {
    fmt::print("{}", config::FaultsText(faults));
    return 1;
  }
  const virtual_cell::World world(
      virtual_cell::ReadCellFile("tests/virtual_cell/demo/cockpit-cell.toml"));
  Results results;
  const int scenes = bench::Choose(bench::EffortFrom(argc, argv), 2, 6, 40);
  for (int k = 0; k < scenes; ++k) {
    Scene(*model, world, static_cast<std::uint64_t>(k) + 1).Measure(**renderer, results);
  }
  fmt::print("{} scenes at {} m, f {} px, mean deflection {:.1f} mm, on {}\n", scenes, kDistance_m,
             kFocal_px, 1e3 * results.deflection_m / (scenes - results.lost),
             (*context)->description());
  fmt::print("| what | RMS px | largest px |\n|---|---|---|\n");
  const auto row = [](const char* what, const Rms& rms) {
    fmt::print("| {} | {:.3f} | {:.3f} |\n", what, rms.px(), rms.largest);
  };
  row("overlay with deflection against the truth", results.overlay);
  row("overlay without deflection against the truth", results.unloaded);
  row("undistorted background against the truth", results.background);
  fmt::print("state to display list {:.2f} ms\n", 1e3 * results.compose_s / scenes);
  bench::Report({.what = "overlay against the rendered truth, 1.5 m, f 1700, RMS",
                 .ours = results.overlay.px(),
                 .unit = "px",
                 .goal = bench::AtMost(0.5),
                 .timed = false});
  bench::Report({.what = fmt::format("scenes of {} whose cell was not found", scenes),
                 .ours = static_cast<double>(results.lost),
                 .goal = bench::AtMost(0),
                 .timed = false});
  return 0;
}
