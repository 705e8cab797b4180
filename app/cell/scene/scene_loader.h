// Loader of the object table and its meshes, which reloads files when they are saved.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/base/log/log_entry.h"
#include "app/cell/scene/mesh_file.h"
#include "app/cell/scene/object_table_file.h"

namespace plumbline::cell {

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

}  // namespace plumbline::cell
