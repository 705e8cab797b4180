// The object table and its meshes while the viewer runs: read, and read again when they are saved.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/log/log_entry.h"
#include "app/scene/mesh_file.h"
#include "app/scene/object_table_file.h"
#include "app/view/status_text.h"

namespace plumbline {

using MeshOfObject = std::shared_ptr<const CheckedMesh>;

/// What there is to be shown; never changed once it is handed out.
struct SceneNow {
  std::uint64_t version = 0;  ///< another number: something changed
  std::optional<ObjectTable> table;
  std::vector<MeshOfObject> meshes;  ///< of each object of the table; null: not read, or refused
  std::vector<PanelLine> remarks;    ///< what is missing, in words
  bool complete = true;              ///< nothing is being read
};

/// Used by one thread.
class SceneStock {
 public:
  static constexpr double kLookPeriod_s = 0.5;

  /// @param objects_file  empty: there is no table
  /// @param tags          what tags and bodies there are; nothing: not checked
  /// @param sink          gets what the log should say
  SceneStock(std::string objects_file, std::optional<TagDatabase> tags, LogSink sink);

  /// Looks at the files, at most every kLookPeriod_s, and at the process that reads meshes.
  /// @return  what there is now
  std::shared_ptr<const SceneNow> Look(double now_s);

 private:
  using Key = std::pair<std::string, double>;  ///< file and unit [m]
  struct Held {
    std::optional<FileStamp> read;  ///< the file as it was read; nothing: not yet
    MeshOfObject mesh;
    std::string problem;
  };
  bool LookAtTable();
  bool LookAtMeshes();
  bool FinishReading();
  void StartReading();
  std::shared_ptr<const SceneNow> Compose();

  const std::string objects_file_;
  const std::optional<TagDatabase> tags_;
  const LogSink sink_;
  ObjectTableFile table_file_;
  MeshReader reader_;
  std::optional<Key> reading_;
  std::deque<Key> waiting_;
  std::map<Key, Held> held_;
  std::vector<PanelLine> table_remarks_;
  double looked_s_ = -1e300;
  std::shared_ptr<const SceneNow> now_ = std::make_shared<SceneNow>();
};

}  // namespace plumbline
