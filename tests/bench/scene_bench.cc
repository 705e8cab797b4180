// Benchmark of distance and interference between two meshes of 50,000 triangles in the bent state
// against plain FCL in the same run, and of updating a mesh for a new bending state.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>

#include "app/cell/scene/interference.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/cell/scene/shapes.h"
#include "tests/bench/bench_timing.h"
#include "tests/bench/rows.h"

using namespace plumbline;

namespace {

void BenchRow(const std::string& what, double ours, double peer, bench::Goal goal = {}) {
  bench::Report(
      {.what = what, .ours = ours, .unit = "ms", .goal = goal, .peer = "FCL", .peers = peer});
}

/// A wavy, non-convex sphere of 50,244 triangles.
scene::TriangleMesh Wavy() {
  scene::TriangleMesh mesh = test::Sphere(0.3F, 160, 158);
  for (Vec3f& p : mesh.vertices_O) {
    p *= 1 + 0.03F * std::sin(40 * p.x()) * std::sin(40 * p.y()) * std::sin(40 * p.z());
  }
  return mesh;
}

scene::BendField Hanging(float tip_m) {
  scene::BendField field;
  field.length_m = 1;
  for (std::size_t i = 0; i < field.stations.size(); ++i) {
    const float z = static_cast<float>(i) / (scene::kBendStations - 1);
    field.stations[i].d_F = {tip_m * z * z, 0, 0};
    field.stations[i].r_F = {0, 2 * tip_m * z, 0};
  }
  return field;
}

using Model = fcl::BVHModel<fcl::OBBRSSd>;

void Build(Model& model, const std::vector<Vec3>& vertices, const scene::TriangleMesh& mesh) {
  std::vector<fcl::Triangle> triangles;
  for (const scene::Triangle& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  model.beginModel();
  model.addSubModel(vertices, triangles);
  model.endModel();
}

fcl::Transform3d TransformOf(const Pose& X) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = X.R;
  transform.translation() = X.p;
  return transform;
}

std::vector<Vec3> BentVertices(const scene::TriangleMesh& mesh, const Pose& X_FO,
                               const scene::BendField& field) {
  std::vector<Vec3> bent;
  for (const Vec3f& p : mesh.vertices_O) {
    bent.push_back(scene::BentPoint(field, X_FO * Vec3(p.cast<double>())));
  }
  return bent;
}

struct Times {
  std::vector<double> ours, peer, depth;
};

}  // namespace

int main(int argc, char** argv) {
  const bench::Effort effort = bench::EffortFrom(argc, argv);
  const int rounds = bench::Choose(effort, 2, 20, 200);
  const auto checked = scene::CheckMesh(Wavy(), 1);
  if (!checked) return 1;
  const scene::TriangleMesh& mesh = checked->mesh;
  const Pose X_FO{Mat3::Identity(), Vec3(0, 0, 0.5)};
  const scene::BendField field = Hanging(0.02F);

  cell::Interference scene;
  double start = bench::CpuTime_ms();
  const std::size_t a = scene.Add(*checked, X_FO, 1, true);
  const double ours_build = bench::CpuTime_ms() - start;
  const std::size_t b = scene.Add(*checked, {}, 1, false);
  scene.Bend(field);

  const std::vector<Vec3> straight = BentVertices(mesh, X_FO, {});
  const std::vector<Vec3> bent = BentVertices(mesh, X_FO, field);
  Model fcl_refit, fcl_b, fcl_bent;  // the peer is built in the bent state, which is its best case
  start = bench::CpuTime_ms();
  Build(fcl_refit, straight, mesh);
  const double peer_build = bench::CpuTime_ms() - start;
  Build(fcl_b, BentVertices(mesh, {}, {}), mesh);
  Build(fcl_bent, bent, mesh);

  fmt::print("{} triangles each, the first bent by 20 mm at 1 m; peer: plain FCL\n\n",
             mesh.triangles.size());
  std::mt19937 random(1);
  std::uniform_real_distribution<double> in(-1, 1);
  const auto any = [&] { return Vec3(in(random), in(random), in(random)); };
  int disagree = 0;
  for (const bool moving : {true, false}) {
    for (const double gap_mm : {300.0, 30.0, 3.0, -3.0, -30.0}) {
      Times times;
      Vec3 rpy = any(), away = any().normalized(), place = any();
      for (int round = 0; round < rounds; ++round) {
        // Between measurements the robot moves by millimetres, or to an arbitrary pose.
        rpy = moving ? Vec3(rpy + 2e-3 * any()) : Vec3(3 * any());
        away = moving ? Vec3(away + 2e-3 * any()).normalized() : any().normalized();
        place = moving ? Vec3(place + 2e-3 * any()) : any();
        const Pose X_WF{RotationFromRollPitchYaw(rpy), place};
        const Vec3 middle = X_WF * scene::BentPoint(field, Vec3(0, 0, 0.5));
        const Pose X_Wb{RotationFromRollPitchYaw(-rpy), middle + (0.6 + 1e-3 * gap_mm) * away};
        scene.Place(a, X_WF);
        scene.Place(b, X_Wb);
        start = bench::CpuTime_ms();
        const cell::Separation found = scene.Measure(a, b, false);
        times.ours.push_back(bench::CpuTime_ms() - start);
        start = bench::CpuTime_ms();
        fcl::CollisionResultd crossing;
        fcl::DistanceResultd distance;
        const auto X = TransformOf(X_WF), Y = TransformOf(X_Wb);
        fcl::collide(&fcl_bent, X, &fcl_b, Y, fcl::CollisionRequestd(), crossing);
        if (!crossing.isCollision()) {
          fcl::distance(&fcl_bent, X, &fcl_b, Y, fcl::DistanceRequestd(true), distance);
        }
        times.peer.push_back(bench::CpuTime_ms() - start);
        const double apart = crossing.isCollision() ? 0 : distance.min_distance;
        if (std::abs(apart - found.distance_m) > 1e-6) ++disagree;
        if (!found.touching) continue;
        start = bench::CpuTime_ms();
        scene.Measure(a, b);
        times.depth.push_back(bench::CpuTime_ms() - start);
      }
      const char* const how = moving ? "moving by 2 mm per measurement" : "arbitrary poses";
      BenchRow(fmt::format("interference and distance at {:g} mm, {}", gap_mm, how),
               bench::Median(times.ours), bench::Median(times.peer), bench::AtMost(1.5));
      if (!times.depth.empty()) {
        bench::Report({.what = fmt::format("depth and direction at {:g} mm, {}", gap_mm, how),
                       .ours = bench::Median(times.depth),
                       .unit = "ms"});
      }
    }
  }
  std::vector<double> ours, peer;
  for (int round = 0; round < bench::Choose(effort, 2, 5, 30); ++round) {
    const scene::BendField other = Hanging(round % 2 == 0 ? 0.01F : 0.02F);
    start = bench::CpuTime_ms();
    scene.Bend(other);
    ours.push_back(bench::CpuTime_ms() - start);
    start = bench::CpuTime_ms();
    const std::vector<Vec3> vertices = BentVertices(mesh, X_FO, other);
    fcl_refit.beginReplaceModel();
    fcl_refit.replaceSubModel(vertices);
    fcl_refit.endReplaceModel(true, false);
    peer.push_back(bench::CpuTime_ms() - start);
  }
  BenchRow("update for a new bending state: vertices and tree", bench::Median(ours),
           bench::Median(peer));
  BenchRow("building the tree", ours_build, peer_build);
  fcl_refit.beginReplaceModel();
  fcl_refit.replaceSubModel(straight);
  fcl_refit.endReplaceModel(true, true);
  Model fcl_straight;
  Build(fcl_straight, straight, mesh);
  const auto away = TransformOf({Mat3::Identity(), Vec3(0.65, 0, 0.5)});
  const auto distance_mm = [&](const Model& model) {
    fcl::DistanceResultd result;
    const auto here = fcl::Transform3d::Identity();
    return 1e3 * fcl::distance(&model, here, &fcl_b, away, fcl::DistanceRequestd(), result);
  };
  fmt::print(
      "FCL: distance with a newly built tree {:.3f} mm, with it refitted bottom-up {:.3f} mm\n",
      distance_mm(fcl_straight), distance_mm(fcl_refit));
  bench::Report({.what = "distances that differ from FCL's by more than 1 um",
                 .ours = static_cast<double>(disagree),
                 .goal = bench::AtMost(0),
                 .timed = false});
  return 0;
}
