#include "app/display/view/cell_view.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/display/view/palette.h"
#include "app/display/view/picture_layout.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::display {
namespace {

/// Radii as shares of the arm's reach: of the first and of the last link, and of a hub.
constexpr double kFirstLink = 0.034, kLastLink = 0.016, kHub = 1.3;
constexpr scene::Colour kLinkColour = palette::FromRgb(0x9aa3ad),
                        kHubColour = palette::FromRgb(0x5b6570),
                        kToolColour = palette::FromRgb(0xd0d5da);

/// Origin of the previous frame, corner and origin of the frame of each link, in W.
struct LinkAxes {
  std::vector<std::array<Vec3, 3>> links_W;
  kinematics::Posture posture;
};

std::optional<LinkAxes> AxesAt(const model::JointVector& q, const cell::ViewModel& model) {
  const kinematics::Chain& chain = model.arm.chain();
  if (q.size() != chain.size() || !q.allFinite()) return std::nullopt;
  LinkAxes axes;
  chain.Evaluate(q, axes.posture);
  const model::Robot& robot = model.config.machine.cell.robot;
  const Pose& X_WB = model.arm.X_WB();
  Pose X_WP = X_WB;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    const Pose X_WL = X_WB * axes.posture.X_BL[i];
    const double a_m = robot.joints[i].a_m;
    const Vec3 corner_W = robot.convention == model::DhConvention::kDistal ? X_WL * Vec3(-a_m, 0, 0)
                                                                           : X_WP * Vec3(a_m, 0, 0);
    axes.links_W.push_back({X_WP.p, corner_W, X_WL.p});
    X_WP = X_WL;
  }
  return axes;
}

void ExtendToPosture(const model::JointVector& q, int tool, const cell::ViewModel& model,
                     Eigen::AlignedBox3d& box_W) {
  const auto axes = AxesAt(q, model);
  if (!axes) return;
  for (const auto& link : axes->links_W) {
    for (const Vec3& p_W : link) box_W.extend(p_W);
  }
  if (tool < model.arm.tools())
    box_W.extend((model.arm.X_WB() * axes->posture.X_BF()) * model.arm.X_FT(tool).p);
}

/// Everything that should be visible in this state.
Eigen::AlignedBox3d ExtentOf(const cell::ViewState& state, const cell::ViewModel& model) {
  Eigen::AlignedBox3d box_W;
  const Vec3& base_W = model.arm.X_WB().p;
  box_W.extend(base_W);
  box_W.extend(Vec3(base_W.x(), base_W.y(), model.config.overlay.grid_z_m));
  ExtendToPosture(state.q, state.tool, model, box_W);
  for (const cell::ViewPoint& point : state.points) {
    if (point.valid) ExtendToPosture(point.q, state.tool, model, box_W);
  }
  for (const correction::AssemblyPoint& point : model.config.machine.points) {
    box_W.extend(point.X_WP.p);
    if (point.near_q) ExtendToPosture(*point.near_q, state.tool, model, box_W);
  }
  return box_W;
}

/// Looks at the middle of the box, from the right of the direction in which the arm works.
Pose PoseFor(const Eigen::AlignedBox3d& box_W, const cell::ViewModel& model) {
  constexpr double kAside_rad = 1.05, kAbove_rad = 0.3, kMargin = 1.15;
  Vec3 ahead_W = box_W.center() - model.arm.X_WB().p;
  ahead_W.z() = 0;
  if (ahead_W.norm() < 0.05) ahead_W = model.arm.X_WB().R.col(0);
  const Vec3 level_W = Eigen::AngleAxisd(-kAside_rad, Vec3::UnitZ()) * ahead_W.normalized();
  const Vec3 away_W = -(std::cos(kAbove_rad) * level_W + std::sin(kAbove_rad) * Vec3::UnitZ());
  const Vec3 right_W = away_W.cross(Vec3::UnitZ()).normalized();
  Pose X_CW;
  X_CW.R << right_W.transpose(), away_W.cross(right_W).transpose(), away_W.transpose();
  const image::ImageSize image{1920, 1080};
  const lens::Lens lens = PlainLens(image);
  double distance_m = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = X_CW.R * (box_W.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)) -
                             box_W.center());
    const double across = std::abs(p.x()) * 2 * lens.fx / image.width;
    const double up = std::abs(p.y()) * 2 * lens.fy / image.height;
    distance_m = std::max(distance_m, kMargin * std::max(across, up) - p.z());
  }
  X_CW.p = Vec3(0, 0, distance_m) - X_CW.R * box_W.center();
  return X_CW;
}

/// Adds solids with one colour to the display list.
class Solids {
 public:
  Solids(const Pose& X_CW, scene::DisplayList& list) : X_CW_(X_CW), list_(list) {}

  void Sphere(const Vec3& p_W, double radius_m, const scene::Colour& colour) {
    Add(scene::kUnitSphere, {Mat3::Identity(), p_W}, Vec3::Constant(radius_m), colour);
  }
  void Rod(const Vec3& from_W, const Vec3& to_W, double radius_m, const scene::Colour& colour) {
    const Vec3 along = to_W - from_W;
    if (!(along.norm() > 1e-6)) return;
    const Mat3 R = RotationOfZOnto(along);
    Add(scene::kUnitCylinder, {R, from_W}, {radius_m, radius_m, along.norm()}, colour);
  }

 private:
  void Add(int mesh, const Pose& X_WO, const Vec3& stretch, const scene::Colour& colour) {
    scene::DrawnMesh& drawn = list_.meshes.emplace_back();
    drawn.mesh = mesh;
    drawn.X_CF = X_CW_;
    drawn.X_FO = X_WO;
    drawn.stretch = stretch;
    drawn.colour = colour;
  }
  const Pose X_CW_;
  scene::DisplayList& list_;
};

scene::Colour Shade(const scene::Colour& colour, bool stale) {
  return stale ? scene::Colour{0.35F * colour.r, 0.35F * colour.g, 0.35F * colour.b, 1} : colour;
}

/// Radius of the outermost fibre, or of a rod of the same area.
double RadiusOf(const model::Section& section) {
  const double reach_m = std::max(section.reach_x_m, section.reach_y_m);
  return reach_m > 0 ? reach_m : std::sqrt(section.area_m2 / 3.14);
}

}  // namespace

Pose Viewpoint::Update(const cell::ViewState& state, const cell::ViewModel& model) {
  constexpr double kGrowth = 0.1;
  if (version_ != model.version) seen_W_.setEmpty();
  version_ = model.version;
  const Eigen::AlignedBox3d now_W = ExtentOf(state, model);
  if (!seen_W_.contains(now_W)) {
    seen_W_.extend(now_W);
    const Vec3 more = kGrowth * seen_W_.sizes();
    seen_W_ = Eigen::AlignedBox3d(seen_W_.min() - more, seen_W_.max() + more);
  }
  return PoseFor(seen_W_, model);
}

cell::Carriers SeenFrom(const Pose& X_CW, cell::Carriers carriers, const cell::ViewModel& model) {
  carriers.world = {X_CW, false};
  carriers.PlaceArm(model);
  return carriers;
}

void AddArm(const cell::ViewState& state, const cell::ViewModel& model,
            const cell::Carriers& carriers, const std::set<int>& declared, scene::DisplayList& list,
            std::vector<Vec3>& centres_C) {
  const auto axes = AxesAt(state.q, model);
  if (!axes || !carriers.world) return;
  const Pose &X_CW = carriers.world->X_CK, &X_WB = model.arm.X_WB();
  const double reach_m = model.arm.chain().Reach();
  const bool stale = carriers.robot_stale;
  const scene::Colour link_colour = Shade(kLinkColour, stale), hub = Shade(kHubColour, stale);
  Solids solids(X_CW, list);
  solids.Rod(X_WB.p, X_WB * Vec3(0, 0, 0.4 * kFirstLink * reach_m), 2.2 * kFirstLink * reach_m,
             hub);
  const std::size_t n = axes->links_W.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double share = n > 1 ? static_cast<double>(i) / static_cast<double>(n - 1) : 0;
    const double radius_m = reach_m * std::lerp(kFirstLink, kLastLink, share);
    const auto& [from_W, corner_W, to_W] = axes->links_W[i];
    for (const Vec3& p_W : axes->links_W[i]) centres_C.push_back(X_CW * p_W);
    if (declared.contains(static_cast<int>(i) + 1)) continue;
    solids.Rod(from_W, corner_W, radius_m, link_colour);
    solids.Rod(corner_W, to_W, radius_m, link_colour);
    solids.Sphere(corner_W, radius_m, link_colour);
    if (i + 1 < n) solids.Sphere(to_W, radius_m, link_colour);
    const Vec3 axis_W = X_WB.R * axes->posture.axis_B[i];
    const Vec3 half_W = kHub * radius_m * axis_W;
    const Vec3 hub_W = X_WB * axes->posture.point_B[i];
    if (i > 0) solids.Rod(hub_W - half_W, hub_W + half_W, kHub * radius_m, hub);
  }
}

void AddTool(const cell::ViewState& state, const cell::ViewModel& model,
             const cell::Carriers& carriers, scene::DisplayList& list) {
  if (!carriers.flange || !carriers.tool || state.tool >= model.arm.tools()) return;
  const model::Tool& tool = model.config.machine.cell.ToolAt(state.tool);
  const scene::Colour colour = Shade(kToolColour, carriers.flange->stale);
  const Pose& X_CF = carriers.flange->X_CK;
  if (tool.segments.empty()) {
    Solids(X_CF, list)
        .Rod(Vec3::Zero(), model.arm.X_FT(state.tool).p,
             0.5 * kLastLink * model.arm.chain().Reach(), colour);
    return;
  }
  double z_m = 0;
  for (const model::ToolSegment& segment : tool.segments) {
    const double radius_m = RadiusOf(segment.section);
    Solids(X_CF, list).Rod({0, 0, z_m}, {0, 0, z_m + segment.length_m}, radius_m, colour);
    list.meshes.back().bends = true;
    z_m += segment.length_m;
  }
}

}  // namespace plumbline::display
