// Background thread that loads the scene and measures in it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/base/log/log_entry.h"
#include "app/cell/scene/carriers.h"
#include "app/cell/scene/interference.h"
#include "app/cell/scene/mesh_file.h"
#include "app/cell/scene/object_table_file.h"
#include "app/cell/view_link/scene_measurements.h"

namespace plumbline::cell {

// Loader of the object table and its meshes, which reloads files when they are saved.

using MeshOfObject = std::shared_ptr<const scene::CheckedMesh>;

/// A problem with the table or a mesh, or progress in reading them, for the display.
struct SceneRemark {
  std::string text;
  bool fault = false;
};

/// Immutable snapshot of the scene.
struct SceneSnapshot {
  std::uint64_t version = 0;  ///< changes with every change of the scene
  std::optional<ObjectTable> table;
  std::vector<MeshOfObject> meshes;  ///< of each object of the table; null if not read, or refused
  std::vector<SceneRemark> remarks;
  bool complete = true;  ///< no mesh is being read
};

/// Used by one thread.
class SceneLoader {
 public:
  static constexpr double kPollPeriod_s = 0.5;

  /// @param objects_file  empty if there is no table
  /// @param tags          known tags and bodies, to check the table against; no check if nullopt
  /// @param sink          receives log entries
  SceneLoader(std::string objects_file, std::optional<target::TagDatabase> tags, log::LogSink sink);

  /// Checks the files for changes, at most every kPollPeriod_s, and the mesh reader for results.
  /// @return  the current scene
  std::shared_ptr<const SceneSnapshot> Poll(double now_s);

 private:
  using Key = std::pair<std::string, double>;  ///< file and unit [m]
  struct LoadedMesh {
    std::optional<FileStamp> read;  ///< of the file when it was read; nullopt until then
    MeshOfObject mesh;
    std::string problem;
  };
  bool PollTable();
  bool PollMeshes();
  bool FinishReading();
  void StartReading();
  std::shared_ptr<const SceneSnapshot> Compose();

  const std::string objects_file_;
  const std::optional<target::TagDatabase> tags_;
  const log::LogSink sink_;
  ObjectTableFile table_file_;
  MeshReader reader_;
  std::optional<Key> reading_;
  std::deque<Key> queue_;
  std::map<Key, LoadedMesh> loaded_;
  std::vector<SceneRemark> table_remarks_;
  double polled_s_ = -1e300;
  std::shared_ptr<const SceneSnapshot> now_ = std::make_shared<SceneSnapshot>();
};

// Measurement of distances, interference and sweeps of the scene's objects in the newest state.

/// Summary for the PLC; its `time_s` is not set.
status::SceneStatus SceneStatusOf(const SceneMeasurements& measured);

/// Input of one measurement.
struct MeasureInput {
  double time_s = 0;  ///< time of the state, monotonic
  Carriers carriers;
};

/// Used by one thread.
class SceneMeasurer {
 public:
  /// @param near_m  warning distance of pairs that state none [m]
  /// @param sink    receives begin and end of interference and nearness
  SceneMeasurer(double near_m, log::LogSink sink);
  ~SceneMeasurer();
  SceneMeasurer(const SceneMeasurer&) = delete;
  SceneMeasurer& operator=(const SceneMeasurer&) = delete;

  /// Switches to another scene once it is complete; building its trees takes 3 us per triangle.
  /// @param end  set by another thread: nothing will be measured, stop as soon as possible
  void SetScene(std::shared_ptr<const SceneSnapshot> scene, const std::atomic<bool>* end = nullptr);

  SceneMeasurements Measure(const MeasureInput& input, double now_s);
  bool idle() const;  ///< the table requests no measurement

 private:
  void Build(const std::atomic<bool>* end);
  bool Place(const Carriers& carriers);
  MeasuredPair MeasurePair(std::size_t index);
  MeasuredDistance MeasureNamed(const SceneDistance& asked) const;
  void MeasureSweeps(const Carriers& carriers, double now_s);
  void LogTransition(const MeasuredPair& pair, scene::Proximity before);
  struct Endpoint {
    std::optional<std::size_t> object;  ///< index in `objects`; nullopt for a point
    Vec3 p_W = Vec3::Zero();            ///< position of a point
  };
  std::optional<Endpoint> ResolveEndpoint(const SceneDistance::End& end) const;
  bool Ready(std::size_t object) const { return solid_[object] && placed_[object]; }

  const double near_m_;
  const log::LogSink sink_;
  std::shared_ptr<const SceneSnapshot> scene_;
  std::unique_ptr<Interference> solids_;
  bool unavailable_ = false;                       ///< the module that measures cannot be loaded
  std::vector<std::optional<std::size_t>> solid_;  ///< of each object, its index in `solids_`
  std::vector<bool> placed_;
  std::vector<scene::InterferenceWatch> watches_;
  const Carriers* carriers_ = nullptr;  ///< valid while Measure() runs
  std::vector<MeasuredSweep> sweeps_;
  double sweep_due_s_ = -1e300;
};

/// Runs at low priority. Measures in the newest submitted state; states submitted while it is busy
/// replace each other. If none is submitted, it only loads.
class SceneWorker {
 public:
  SceneWorker(std::string objects_file, std::optional<target::TagDatabase> tags, double near_m,
              const log::LogSink& sink);
  ~SceneWorker();
  SceneWorker(const SceneWorker&) = delete;
  SceneWorker& operator=(const SceneWorker&) = delete;

  /// Ends the thread without waiting for it: building trees may take seconds.
  void End();
  bool ended() const { return ended_; }

  void Submit(MeasureInput input);
  std::shared_ptr<const SceneSnapshot> Scene() const;
  /// @return  null before the first measurement
  std::shared_ptr<const SceneMeasurements> Newest() const;

 private:
  void Run();
  void RunUntilEnd();

  const log::LogSink sink_;
  SceneLoader loader_;
  std::shared_ptr<const SceneSnapshot> taken_;  ///< in use by measurer_; accessed by thread_ only
  SceneMeasurer measurer_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<bool> end_ = false, ended_ = false;
  std::optional<MeasureInput> input_;
  std::shared_ptr<const SceneSnapshot> scene_ = std::make_shared<SceneSnapshot>();
  std::shared_ptr<const SceneMeasurements> measured_;
  std::thread thread_;
};

}  // namespace plumbline::cell
