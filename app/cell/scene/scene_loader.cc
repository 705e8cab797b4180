#include "app/cell/scene/scene_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "app/base/log/fault_log.h"

namespace plumbline::cell {

namespace {

log::LogEntry EntryAbout(log::Event event, const std::string& text) {
  return {event, text, {{"ABOUT", text}}};
}

}  // namespace

SceneLoader::SceneLoader(std::string objects_file, std::optional<target::TagDatabase> tags,
                         log::LogSink sink)
    : objects_file_(std::move(objects_file)),
      tags_(std::move(tags)),
      sink_(std::move(sink)),
      table_file_(objects_file_, tags_ ? &*tags_ : nullptr) {}

std::shared_ptr<const SceneSnapshot> SceneLoader::Poll(double now_s) {
  bool changed = FinishReading();
  if (!objects_file_.empty() && now_s - polled_s_ >= kPollPeriod_s) {
    polled_s_ = now_s;
    changed = PollTable() || changed;
    changed = PollMeshes() || changed;
  }
  StartReading();
  return changed ? Compose() : now_;
}

bool SceneLoader::PollTable() {
  const std::optional<ObjectTableUpdate> news = table_file_.Poll();
  if (!news) return false;
  table_remarks_.clear();
  for (const config::Fault& fault : news->faults.All()) {
    const bool bad = fault.severity == config::Fault::Severity::kFault;
    sink_(log::LogEntryFromFault(fault));
    table_remarks_.push_back({config::FaultText(fault), bad});
  }
  if (!news->accepted) {
    const bool has_previous = table_file_.table().has_value();
    table_remarks_.insert(table_remarks_.begin(),
                          {has_previous ? "object table has faults: the previous one stays in use"
                                        : "object table has faults: no virtual objects are shown",
                           true});
  }
  return true;
}

/// Queues meshes that are new or were saved again, and drops those that the table no longer names.
bool SceneLoader::PollMeshes() {
  if (!table_file_.table()) return false;
  std::set<Key> named;
  for (const SceneObject& object : table_file_.table()->objects) {
    named.insert({object.file, object.unit_m});
  }
  const auto before = loaded_.size();
  std::erase_if(loaded_, [&](const auto& one) { return !named.contains(one.first); });
  bool changed = loaded_.size() != before;
  for (const Key& key : named) {
    LoadedMesh& loaded = loaded_[key];
    const FileStamp stamp = StampOfFile(key.first);
    const bool due = !loaded.read || *loaded.read != stamp;
    const bool queued = std::find(queue_.begin(), queue_.end(), key) != queue_.end();
    if (!due || queued || (reading_ && *reading_ == key)) continue;
    queue_.push_back(key);
    changed = true;
  }
  return changed;
}

void SceneLoader::StartReading() {
  while (reader_.idle() && !queue_.empty()) {
    const Key key = queue_.front();
    queue_.pop_front();
    const auto loaded = loaded_.find(key);
    if (loaded == loaded_.end()) continue;  // no longer named by the table
    loaded->second.read = StampOfFile(key.first);
    if (const auto started = reader_.Start(key.first, key.second); !started) {
      loaded->second.problem = started.error();
      sink_(EntryAbout(log::Event::kViewFault, started.error()));
      Compose();
      continue;
    }
    reading_ = key;
  }
}

bool SceneLoader::FinishReading() {
  if (!reading_) return false;
  auto answer = reader_.Poll(0);
  if (!answer) return false;
  const auto loaded = loaded_.find(*reading_);
  reading_.reset();
  if (loaded == loaded_.end()) return true;
  const std::string name = std::filesystem::path(loaded->first.first).filename().string();
  if (!*answer) {
    // As with the table, the previous mesh stays in use if the new file is faulty.
    loaded->second.problem = fmt::format("{}: {}", name, answer->error());
    sink_(EntryAbout(log::Event::kViewFault, loaded->second.problem));
    return true;
  }
  MeshFile file = std::move(*answer).value();
  loaded->second.problem.clear();
  sink_(EntryAbout(log::Event::kViewNote,
                   fmt::format("{}: {} triangles", name, file.checked.mesh.triangles.size())));
  loaded->second.mesh = std::make_shared<const scene::CheckedMesh>(std::move(file.checked));
  return true;
}

std::shared_ptr<const SceneSnapshot> SceneLoader::Compose() {
  auto scene = std::make_shared<SceneSnapshot>();
  scene->version = now_->version + 1;
  scene->table = table_file_.table();
  scene->remarks = table_remarks_;
  scene->complete = queue_.empty() && !reading_;
  if (!scene->complete) scene->remarks.push_back({"reading meshes"});
  for (const auto& [key, loaded] : loaded_) {
    if (!loaded.problem.empty()) scene->remarks.push_back({loaded.problem, true});
  }
  if (scene->table) {
    for (const SceneObject& object : scene->table->objects) {
      const auto loaded = loaded_.find({object.file, object.unit_m});
      scene->meshes.push_back(loaded == loaded_.end() ? nullptr : loaded->second.mesh);
    }
  }
  now_ = std::move(scene);
  return now_;
}

}  // namespace plumbline::cell
