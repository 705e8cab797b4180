// Distances, interference and sweeps of placed and bent meshes.
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "app/cell/view_link/scene_measurements.h"
#include "firmware-like/scene/bend_field.h"
#include "firmware-like/scene/mesh_facts.h"

namespace plumbline::cell {

struct TrianglePair;

/// Meshes with bounding volume trees. Building takes about 3 us per triangle. Bending shifts and
/// enlarges the boxes, which is valid for any bending. Used by one thread. Programs load it as a
/// module, by its virtual functions: FCL would double the time of each of their starts.
class Interference {
 public:
  static constexpr double kDepthStep_m = 1e-5;
  static constexpr double kSweepStep_m = 1e-3;
  static constexpr double kBendStep_m = 1e-5;

  Interference();
  virtual ~Interference();
  Interference(const Interference&) = delete;
  Interference& operator=(const Interference&) = delete;

  /// Adds a mesh; its point p_O is at p_K = X_KO (scale p_O) in the carrier's frame K.
  /// @param bends  K is the flange, and the mesh follows Bend()
  /// @return       the object's index: 0, 1, ...
  virtual std::size_t Add(const scene::CheckedMesh& mesh, const Pose& X_KO, double scale,
                          bool bends);
  virtual std::size_t size() const;

  /// Sets the tool's bending. Meshes are updated only if a station moved by more than kBendStep_m,
  /// or its rotation moves the tip by more.
  /// @return  whether they were updated
  virtual bool Bend(const scene::BendField& field);
  virtual void Place(std::size_t object, const Pose& X_WK);

  /// @param with_depth  compute depth and direction if the objects touch
  virtual Separation Measure(std::size_t a, std::size_t b, bool with_depth = true);

  /// Position in W of a point given in the object's own frame, placed and bent.
  virtual Vec3 PointOf(std::size_t object, const Vec3& p_O) const;
  /// Distance from a point to a surface, accurate to 1 um.
  virtual Separation FromPoint(const Vec3& p_W, std::size_t object) const;

  /// Moves an object along a polyline with fixed orientation and its current bending, and stops at
  /// the first contact. Each step is the free distance, but at least kSweepStep_m: overlaps shorter
  /// than that can be missed.
  /// @param X_WO     pose of the object's own frame for the path point at the origin of W
  /// @param path_W   at least one point
  virtual SweepResult Sweep(std::size_t object, const Pose& X_WO, const std::vector<Vec3>& path_W,
                            const std::vector<std::size_t>& against);

 private:
  struct Solid;
  std::vector<std::unique_ptr<Solid>> solids_;
  scene::BendField field_;
  std::map<std::pair<std::size_t, std::size_t>, TrianglePair> nearest_;
};

/// File name of the module, and name of its function of type MakeInterference. The number is the
/// version of this interface.
using MakeInterference = Interference*();
inline constexpr const char* kInterferenceModuleFile = "plumbline-interference.so";
inline constexpr const char* kMakeInterferenceName = "plumbline_make_interference_1";

}  // namespace plumbline::cell
