#include "app/display/view/overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>

#include "app/display/view/cell_view.h"
#include "app/display/view/palette.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/known_lens.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::display {
namespace {

using palette::kAlarm, palette::kCorrected, palette::kTaught, palette::kUncorrected,
    palette::kWarning;

constexpr int kFirst = 0, kInvalid = 1, kPoint = 2, kOther = 3;  ///< ranks of labels
constexpr float kNominalOpacity = 0.35F;
constexpr float kToolWidth_em = 1.2F;  ///< kept clear around the tool axis and each mark
constexpr double kBesideShare = 0.2;   ///< of the image area's width
constexpr int kCircleCorners = 48;
constexpr int kRegionCorners = 96;

class OverlayBuilder {
 public:
  OverlayBuilder(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
                 scene::DisplayList& list, ImageMarks& marks)
      : state_(*input.facts.state),
        camera_(cell::CameraOf(state_, k)),
        carriers_(input.facts.carriers[k]),
        facts_(input.facts),
        config_(input.config),
        meshes_(input.meshes),
        mesh_facts_(input.mesh_facts),
        pixels_(k < input.pixels.size() ? input.pixels[k] : nullptr),
        layout_(layout),
        list_(list),
        marks_(marks) {}

  void Build() {
    AddBackground();
    AddUsableRegion();
    list_.exaggeration = config_.exaggeration;
    list_.stress_full_Pa = config_.stress_full_Pa;
    if (carriers_.tool) list_.bend = carriers_.tool->bend;
    if (!seen()) return;
    AddGround();
    if (facts_.table != nullptr) {
      AddObjects(*facts_.table);
      AddLines(*facts_.table);
      AddClip(*facts_.table);
    }
    if (drawn()) AddSolids();
    AddToolAxis();
    AddPoints();
    AddMeasured();
    AddMeasuredTip();
  }

 private:
  /// Nothing can be projected into the image without a lens.
  bool imaged() const { return camera_.lens.has_value() && camera_.image.has_value(); }
  bool seen() const { return imaged() || drawn(); }
  /// The whole cell is drawn, without a camera.
  bool drawn() const {
    return state_.cameras.empty() && carriers_.world && facts_.model != nullptr;
  }

  void AddBackground() {
    const auto& image = camera_.image;
    const image::ImageSize size =
        image ? image::ImageSize{image->width, image->height} : image::ImageSize{1920, 1080};
    const lens::Lens lens = camera_.lens ? *camera_.lens : PlainLens(size);
    list_.size = layout_.size;
    list_.pinhole = PinholeIn(layout_.image, lens, size);
    const bool wanted = config_.background && (facts_.table == nullptr || facts_.table->background);
    if (!wanted || !image || pixels_ == nullptr) return;
    list_.background.luma = {pixels_, image->width, image->height, image->width};
    if (image->colour) list_.background.bgr = pixels_;
    list_.background.sequence = std::bit_cast<std::uint64_t>(image->time_s);
    list_.background.lens = lens;
  }

  /// Outline of the region where the lens is trusted, as far as it lies in the image.
  void AddUsableRegion() {
    if (!imaged() || !camera_.usable_radius_px) return;
    const image::ImageSize size{camera_.image->width, camera_.image->height};
    const lens::Vec2 middle = lens::MiddleOf(size);
    std::vector<Vec3> points_C;
    const auto finish = [&] {
      if (points_C.size() > 1) AddLine(std::move(points_C), kWarning, 2, true);
      points_C.clear();
    };
    for (int k = 0; k <= kRegionCorners; ++k) {
      const double angle = 2 * std::numbers::pi * k / kRegionCorners;
      const lens::Vec2 pixel =
          middle + *camera_.usable_radius_px * lens::Vec2(std::cos(angle), std::sin(angle));
      const bool inside =
          (pixel.array() >= 0).all() && pixel.x() < size.width && pixel.y() < size.height;
      const auto n = inside ? lens::NormalisedOfPixel(*camera_.lens, pixel) : std::nullopt;
      if (n) {
        points_C.emplace_back(n->x(), n->y(), 1);
      } else {
        finish();
      }
    }
    finish();
  }

  std::optional<lens::Vec2> PixelOf(const Vec3& p_C) const {
    if (!(p_C.z() > 0.02) || !p_C.allFinite()) return std::nullopt;
    return Project<double>(list_.pinhole, p_C);
  }

  void AddLabel(const Vec3& p_C, std::string text, const scene::Colour& colour, int rank = kOther,
                std::string shorter = "") {
    if (const auto pixel = PixelOf(p_C)) {
      // Pixel (0, 0) is the centre of a pixel; strokes and boxes count from its edge.
      marks_.labels.push_back({static_cast<float>(pixel->x()) + 0.5F,
                               static_cast<float>(pixel->y()) + 0.5F, std::move(text), colour, rank,
                               std::move(shorter)});
    }
  }

  /// Keeps the smallest upright rectangle around the points clear, with a margin.
  void KeepClear(const std::vector<Vec3>& points_C, float margin_em) {
    float left = 1e9F, top = 1e9F, right = -1e9F, bottom = -1e9F;
    for (const Vec3& p_C : points_C) {
      const auto pixel = PixelOf(p_C);
      if (!pixel) continue;
      left = std::min(left, static_cast<float>(pixel->x()));
      right = std::max(right, static_cast<float>(pixel->x()));
      top = std::min(top, static_cast<float>(pixel->y()));
      bottom = std::max(bottom, static_cast<float>(pixel->y()));
    }
    const float margin = margin_em * layout_.em;
    if (right < left) return;
    marks_.keep_clear.push_back(
        {left - margin, top - margin, right - left + 2 * margin, bottom - top + 2 * margin});
  }

  /// Keeps a tool's mesh clear: its bounding box in slices along the longest edge.
  void KeepMeshClear(const scene::DrawnMesh& mesh, const scene::MeshFacts& facts) {
    constexpr int kSlices = 10;
    const Vec3 size = facts.max_O - facts.min_O;
    Eigen::Index longest = 0;
    size.maxCoeff(&longest);
    for (int slice = 0; slice < kSlices; ++slice) {
      std::vector<Vec3> corners_C;
      for (int corner = 0; corner < 8; ++corner) {
        Vec3 share(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        share[longest] = (slice + share[longest]) / kSlices;
        const Vec3 p = facts.min_O + share.cwiseProduct(size);
        corners_C.push_back(mesh.X_CF * (mesh.X_FO * Vec3(mesh.scale * p)));
      }
      KeepClear(corners_C, 0.3F);
    }
  }

  /// Length in the image plane's direction that spans `pixels` at a point [m].
  double LengthOf(double pixels, const Vec3& p_C) const {
    return pixels * std::max(p_C.z(), 0.02) / list_.pinhole.fx;
  }

  void AddLine(std::vector<Vec3> points_C, const scene::Colour& colour, float width_px = 2,
               bool dashed = false, bool in_front = true) {
    list_.lines.push_back({std::move(points_C), colour, width_px, dashed, in_front});
  }

  void AddObjects(const cell::ObjectTable& table) {
    for (std::size_t k = 0; k < table.objects.size() && k < meshes_.size(); ++k) {
      const cell::SceneObject& object = table.objects[k];
      const cell::PlacedCarrier* const placed = carriers_.Find(object.on);
      if (!object.visible || meshes_[k] == 0 || placed == nullptr) continue;
      scene::DrawnMesh mesh;
      mesh.mesh = meshes_[k];
      mesh.X_CF = placed->X_CK;
      mesh.X_FO = object.X_KO;
      mesh.scale = object.scale;
      mesh.bends = object.bends;
      mesh.occludes = object.occludes;
      mesh.by_stress = object.bends && config_.stress && !placed->stale;
      mesh.colour = placed->stale ? Greyed(object.colour) : object.colour;
      list_.meshes.push_back(mesh);
      const bool tool = object.on.kind == cell::Carrier::Kind::kFlange;
      if (tool && k < mesh_facts_.size() && mesh_facts_[k] != nullptr)
        KeepMeshClear(mesh, *mesh_facts_[k]);
      if (object.bends) AddNominal(mesh, object.colour);
    }
    if (config_.nominal == config::OverlayConfig::Nominal::kBeside) NameBoth();
  }

  /// Flange of the unloaded arm, shifted aside if the two tools are drawn beside each other.
  std::optional<Pose> NominalInCamera() const {
    if (!carriers_.world || !carriers_.tool) return std::nullopt;
    Pose X_CF = carriers_.world->X_CK * carriers_.tool->X_WF_nominal;
    if (config_.nominal == config::OverlayConfig::Nominal::kBeside) {
      X_CF.p.x() -= LengthOf(kBesideShare * static_cast<double>(layout_.image.width), X_CF.p);
    }
    return X_CF;
  }

  void AddNominal(scene::DrawnMesh mesh, scene::Colour colour) {
    if (config_.nominal == config::OverlayConfig::Nominal::kHidden) return;
    const auto X_CF = NominalInCamera();
    if (!X_CF) return;
    mesh.X_CF = *X_CF;
    mesh.bends = false;
    mesh.by_stress = false;
    colour.a *= kNominalOpacity;
    mesh.colour = carriers_.flange && carriers_.flange->stale ? Greyed(colour) : colour;
    list_.meshes.push_back(mesh);
  }

  void NameBoth() {
    const auto X_CF = NominalInCamera();
    if (!X_CF || !carriers_.flange) return;
    AddLabel(X_CF->p, "without load", kTaught);
    AddLabel(carriers_.flange->X_CK.p, "loaded", kTaught);
  }

  void AddLines(const cell::ObjectTable& table) {
    for (const cell::SceneLine& line : table.lines) {
      const cell::PlacedCarrier* const placed = carriers_.Find(line.on);
      if (!line.visible || placed == nullptr || line.points_K.empty()) continue;
      std::vector<Vec3> points_C;
      for (const Vec3& p_K : line.points_K) points_C.push_back(placed->X_CK * p_K);
      const scene::Colour colour = placed->stale ? Greyed(line.colour) : line.colour;
      AddLabel(points_C.front(), line.name, colour);
      AddLine(std::move(points_C), colour, line.width_px, line.dashed, false);
    }
  }

  void AddClip(const cell::ObjectTable& table) {
    if (!table.clip) return;
    const cell::PlacedCarrier* const placed = carriers_.Find(table.clip->on);
    if (placed == nullptr) return;
    scene::ClipPlane clip;
    clip.normal_C = placed->X_CK.R * table.clip->normal_K;
    clip.distance_m = table.clip->distance_m + clip.normal_C.dot(placed->X_CK.p);
    clip.grid = table.clip->grid;
    list_.clip = clip;
  }

  void AddGround() {
    constexpr double kWithoutCamera_m = 0.5;
    const double cell_m = config_.grid_m > 0 || !drawn() ? config_.grid_m : kWithoutCamera_m;
    if (!(cell_m > 0) || !carriers_.world) return;
    const Pose X_WG{Mat3::Identity(), Vec3(0, 0, config_.grid_z_m)};
    list_.ground = scene::GroundGrid{.X_CG = carriers_.world->X_CK * X_WG, .cell_m = cell_m};
  }

  /// Arm and tool, without the links and the tool that the object table has a mesh of.
  void AddSolids() {
    std::set<int> links;
    bool tool = false;
    for (std::size_t k = 0; facts_.table != nullptr && k < facts_.table->objects.size(); ++k) {
      const cell::SceneObject& object = facts_.table->objects[k];
      if (!object.visible) continue;
      tool = tool || object.on.kind == cell::Carrier::Kind::kFlange;
      if (object.on.kind == cell::Carrier::Kind::kLink) links.insert(object.on.link);
    }
    std::vector<Vec3> centres_C;
    AddArm(state_, *facts_.model, carriers_, links, list_, centres_C);
    for (std::size_t k = 1; k < centres_C.size(); ++k)
      KeepClear({centres_C[k - 1], centres_C[k]}, kToolWidth_em);
    if (!tool) AddTool(state_, *facts_.model, carriers_, list_);
  }

  void AddToolAxis() {
    if (!carriers_.flange || !carriers_.tool || !carriers_.world) return;
    const cell::ToolState& tool = *carriers_.tool;
    const Vec3 tip_F = tool.X_WF_nominal.Inverse() * tool.tip_nominal_W;
    if (!(tip_F.norm() > 0)) return;
    const Pose& X_CF = carriers_.flange->X_CK;
    std::vector<Vec3> bent, straight;
    for (int k = 0; k < scene::kBendStations; ++k) {
      const Vec3 p_F = static_cast<double>(k) / (scene::kBendStations - 1) * tip_F;
      const Vec3 moved_F = scene::BentPoint(tool.bend, p_F) - p_F;
      bent.push_back(X_CF * Vec3(p_F + config_.exaggeration * moved_F));
    }
    const Pose X_CF_nominal = carriers_.world->X_CK * tool.X_WF_nominal;
    straight = {X_CF_nominal.p, X_CF_nominal * tip_F};
    const bool stale = carriers_.flange->stale;
    AddLine(std::move(straight), stale ? Greyed(kTaught) : kTaught, 1.5F, true);
    const Vec3 tip_C = bent.back();
    for (std::size_t k = 1; k < bent.size(); ++k) KeepClear({bent[k - 1], bent[k]}, kToolWidth_em);
    AddLine(std::move(bent), stale ? Greyed(kCorrected) : kCorrected, 2.5F);
    AddCircle(tip_C, LengthOf(4, tip_C), stale ? Greyed(kCorrected) : kCorrected);
  }

  void AddCross(const Vec3& p_C, double arm_px, bool upright, const scene::Colour& colour) {
    const double a = LengthOf(arm_px, p_C);
    const Vec3 first = upright ? Vec3(a, 0, 0) : Vec3(a, a, 0) / std::numbers::sqrt2;
    const Vec3 second = upright ? Vec3(0, a, 0) : Vec3(a, -a, 0) / std::numbers::sqrt2;
    AddLine({p_C - first, p_C + first}, colour);
    AddLine({p_C - second, p_C + second}, colour);
  }

  /// Facing the camera.
  void AddCircle(const Vec3& p_C, double radius_m, const scene::Colour& colour) {
    if (!(p_C.z() > 0) || !(radius_m > 0)) return;
    const Vec3 ahead = p_C.normalized();
    const Vec3 right = Vec3::UnitY().cross(ahead).normalized();
    const Vec3 down = ahead.cross(right);
    std::vector<Vec3> points;
    for (int k = 0; k <= kCircleCorners; ++k) {
      const double angle = 2 * std::numbers::pi * k / kCircleCorners;
      points.emplace_back(p_C + radius_m * (std::cos(angle) * right + std::sin(angle) * down));
    }
    AddLine(std::move(points), colour);
  }

  void AddPoints() {
    if (facts_.model == nullptr || !carriers_.world) return;
    const Pose& X_CW = carriers_.world->X_CK;
    const Mat3& R_WB = facts_.model->arm.X_WB().R;
    const bool stale = carriers_.world->stale || carriers_.robot_stale;
    const auto shade = [stale](const scene::Colour& colour) {
      return stale ? Greyed(colour) : colour;
    };
    const double mark_px = 0.4 * static_cast<double>(layout_.em);
    for (const correction::AssemblyPoint& point : facts_.model->config.machine.points) {
      const Vec3 p_C = X_CW * point.X_WP.p;
      AddCross(p_C, mark_px, true, shade(kTaught));
      KeepClear({p_C}, kToolWidth_em);
      const std::string name = point.name.empty() ? fmt::format("{}", point.id) : point.name;
      const auto output =
          std::find_if(state_.points.begin(), state_.points.end(),
                       [&](const cell::ViewPoint& one) { return one.id == point.id; });
      if (output == state_.points.end() || !output->valid) {
        AddLabel(p_C, "■ " + name + ": no correction", shade(kAlarm), kInvalid, "■ " + name);
        continue;
      }
      const double e = config_.exaggeration;
      const Vec3 missed_C = X_CW * Vec3(point.X_WP.p - e * (R_WB * output->translation_B));
      AddLine({p_C, missed_C}, shade(kUncorrected), 2, true);
      AddCircle(missed_C, LengthOf(mark_px, missed_C), shade(kUncorrected));
      if (output->basis != model::RadiusBasis::kUnknown)
        AddCircle(p_C, e * output->uncertainty_m, shade(kCorrected));
      KeepClear({missed_C}, kToolWidth_em);
      AddLabel(p_C, name, shade(kTaught), kPoint);  // its numbers are in its tile
    }
  }

  /// For little room: the glyph and the colour say that they interfere.
  static std::string ShortPairText(const cell::MeasuredPair& pair,
                                   const cell::Separation& between) {
    if (pair.state != scene::Proximity::kInterference) return "";
    const std::string names = fmt::format("■ {} / {}", pair.a, pair.b);
    return between.touching ? fmt::format("{} {:.1f} mm deep", names, kMmPerMetre * between.depth_m)
                            : names;
  }

  static std::string PairText(const cell::MeasuredPair& pair, const cell::Separation& between) {
    const std::string names = pair.a + " / " + pair.b;
    if (pair.state != scene::Proximity::kInterference)
      return fmt::format("▲ {}: {:.1f} mm", names, kMmPerMetre * between.distance_m);
    return between.touching ? fmt::format("■ {}: INTERFERENCE {:.1f} mm deep", names,
                                          kMmPerMetre * between.depth_m)
                            : fmt::format("■ {}: INTERFERENCE", names);
  }

  void AddMeasured() {
    const cell::SceneMeasurements* const measured = facts_.measured;
    if (measured == nullptr || !carriers_.world || carriers_.world->stale) return;
    if (facts_.now_s - measured->time_s > cell::kMeasuredFresh_s) return;
    const Pose& X_CW = carriers_.world->X_CK;
    for (const cell::MeasuredPair& pair : measured->pairs) {
      if (!pair.separation || pair.state == scene::Proximity::kApart) continue;
      const cell::Separation& between = *pair.separation;
      const bool hits = pair.state == scene::Proximity::kInterference;
      const Vec3 a_C = X_CW * between.p_a_W, b_C = X_CW * between.p_b_W;
      const scene::Colour& colour = hits ? kAlarm : kWarning;
      AddLine({a_C, b_C}, colour, 3);
      if (hits) AddCircle(a_C, LengthOf(layout_.em, a_C), colour);
      AddLabel(b_C, PairText(pair, between), colour, kFirst, ShortPairText(pair, between));
    }
    for (const cell::MeasuredDistance& distance : measured->distances) {
      if (!distance.distance_m) continue;
      const Vec3 a_C = X_CW * distance.p_a_W, b_C = X_CW * distance.p_b_W;
      AddLine({a_C, b_C}, kTaught, 1.5F, true);
      AddLabel((a_C + b_C) / 2,
               fmt::format("{} {:.1f} mm", distance.name, 1e3 * *distance.distance_m), kTaught);
    }
    for (const cell::MeasuredSweep& sweep : measured->sweeps) {
      if (!sweep.result || !sweep.result->hits) continue;
      const Vec3 p_C = X_CW * sweep.result->p_W;
      AddCross(p_C, static_cast<double>(layout_.em), false, kAlarm);
      AddLabel(p_C, fmt::format("■ {} hits {}", sweep.name, sweep.other), kAlarm, kFirst);
    }
  }

  /// The tip as this camera measures it.
  void AddMeasuredTip() {
    const status::CameraStatus& status = camera_.status;
    if (!status.tip_valid || !carriers_.world || carriers_.world->stale) return;
    const Vec3 p_C = carriers_.world->X_CK * status.tip_W;
    const double ring_px = 0.6 * static_cast<double>(layout_.em);
    AddCircle(p_C, LengthOf(ring_px, p_C), kTaught);
    AddCross(p_C, 1.6 * ring_px, false, kTaught);
    KeepClear({p_C}, kToolWidth_em);
    const double radius_m =
        statistics::RadiusHolding95Percent(status.tip_covariance_W + status.tip_tag_covariance_W);
    AddLabel(p_C, fmt::format("tip as measured ±{:.2f} mm", kMmPerMetre * radius_m), kTaught,
             kPoint, "tip as measured");
  }

  const cell::ViewState& state_;
  const cell::ViewCamera& camera_;
  const cell::Carriers& carriers_;
  const ViewFacts& facts_;
  const config::OverlayConfig& config_;
  const std::vector<int>& meshes_;
  const std::vector<const scene::MeshFacts*>& mesh_facts_;
  const std::uint8_t* const pixels_;
  const PictureLayout& layout_;
  scene::DisplayList& list_;
  ImageMarks& marks_;
};

}  // namespace

scene::Colour Greyed(const scene::Colour& colour) {
  return {0.55F, 0.55F, 0.55F, 0.5F * colour.a};
}

void AddOverlay(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
                scene::DisplayList& list, ImageMarks& marks) {
  OverlayBuilder(input, k, layout, list, marks).Build();
}

}  // namespace plumbline::display
