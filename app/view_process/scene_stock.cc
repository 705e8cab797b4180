#include "app/view_process/scene_stock.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "app/log/fault_log.h"
#include "app/view_process/view_entries.h"

namespace plumbline {

SceneStock::SceneStock(std::string objects_file, std::optional<TagDatabase> tags, LogSink sink)
    : objects_file_(std::move(objects_file)),
      tags_(std::move(tags)),
      sink_(std::move(sink)),
      table_file_(objects_file_, tags_ ? &*tags_ : nullptr) {}

std::shared_ptr<const SceneNow> SceneStock::Look(double now_s) {
  bool changed = FinishReading();
  if (!objects_file_.empty() && now_s - looked_s_ >= kLookPeriod_s) {
    looked_s_ = now_s;
    changed = LookAtTable() || changed;
    changed = LookAtMeshes() || changed;
  }
  StartReading();
  return changed ? Compose() : now_;
}

bool SceneStock::LookAtTable() {
  const std::optional<TableNews> news = table_file_.Look();
  if (!news) return false;
  table_remarks_.clear();
  for (const Fault& fault : news->faults.All()) {
    const bool bad = fault.severity == Fault::Severity::kFault;
    sink_(EntryOfFault(fault));
    table_remarks_.push_back({FaultText(fault), bad ? Tone::kBad : Tone::kAttention});
  }
  if (!news->accepted) {
    const bool former = table_file_.table().has_value();
    table_remarks_.insert(table_remarks_.begin(),
                          {former ? "the table has faults: the one before stays"
                                  : "the table has faults: nothing virtual is shown",
                           Tone::kBad});
  }
  return true;
}

/// Meshes that are new, or were saved anew, wait to be read; what nobody names is let go.
bool SceneStock::LookAtMeshes() {
  if (!table_file_.table()) return false;
  std::set<Key> named;
  for (const SceneObject& object : table_file_.table()->objects) {
    named.insert({object.file, object.unit_m});
  }
  const auto before = held_.size();
  std::erase_if(held_, [&](const auto& one) { return !named.contains(one.first); });
  bool changed = held_.size() != before;
  for (const Key& key : named) {
    Held& held = held_[key];
    const FileStamp stamp = StampOfFile(key.first);
    const bool due = !held.read || *held.read != stamp;
    const bool queued = std::find(waiting_.begin(), waiting_.end(), key) != waiting_.end();
    if (!due || queued || (reading_ && *reading_ == key)) continue;
    waiting_.push_back(key);
    changed = true;
  }
  return changed;
}

void SceneStock::StartReading() {
  while (reader_.idle() && !waiting_.empty()) {
    const Key key = waiting_.front();
    waiting_.pop_front();
    const auto held = held_.find(key);
    if (held == held_.end()) continue;  // meanwhile nobody names it
    held->second.read = StampOfFile(key.first);
    if (const auto started = reader_.Start(key.first, key.second); !started) {
      held->second.problem = started.error();
      sink_(ViewFault(started.error()));
      Compose();
      continue;
    }
    reading_ = key;
  }
}

bool SceneStock::FinishReading() {
  if (!reading_) return false;
  auto answer = reader_.Poll(0);
  if (!answer) return false;
  const auto held = held_.find(*reading_);
  reading_.reset();
  if (held == held_.end()) return true;
  const std::string name = std::filesystem::path(held->first.first).filename().string();
  if (!*answer) {
    // A file that was good and is bad now: the mesh before stays, as the table before does.
    held->second.problem = fmt::format("{}: {}", name, answer->error());
    sink_(ViewFault(held->second.problem));
    return true;
  }
  MeshFile file = std::move(*answer).value();
  held->second.problem.clear();
  sink_(ViewNote(fmt::format("{}: {} triangles", name, file.checked.mesh.triangles.size())));
  held->second.mesh = std::make_shared<const CheckedMesh>(std::move(file.checked));
  return true;
}

std::shared_ptr<const SceneNow> SceneStock::Compose() {
  auto scene = std::make_shared<SceneNow>();
  scene->version = now_->version + 1;
  scene->table = table_file_.table();
  scene->remarks = table_remarks_;
  scene->complete = waiting_.empty() && !reading_;
  if (!scene->complete) scene->remarks.push_back({"meshes are being read", Tone::kAttention});
  for (const auto& [key, held] : held_) {
    if (!held.problem.empty()) scene->remarks.push_back({held.problem, Tone::kBad});
  }
  if (scene->table) {
    for (const SceneObject& object : scene->table->objects) {
      const auto held = held_.find({object.file, object.unit_m});
      scene->meshes.push_back(held == held_.end() ? nullptr : held->second.mesh);
    }
  }
  now_ = std::move(scene);
  return now_;
}

}  // namespace plumbline
