#include "app/cell/scene/scene_worker.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <set>

#include "app/base/log/log.h"
#include "drivers/clock.h"
#include "drivers/files/package_paths.h"
#include "firmware-like/result.h"

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
  const std::string coarse = PrecisionProblem(file);
  loaded->second.problem = coarse.empty() ? "" : fmt::format("{}: {}", name, coarse);
  if (!coarse.empty()) sink_(EntryAbout(log::Event::kViewFault, loaded->second.problem));
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

namespace {

constexpr double kSweepPeriod_s = 1.0;
constexpr double kSweepPauseFactor = 10;  ///< pause after a sweep, in multiples of its duration

Result<std::unique_ptr<Interference>> LoadInterference() {
  const std::string module = files::SiblingModule(kInterferenceModuleFile);
  void* const loaded = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const make = loaded != nullptr ? dlsym(loaded, kMakeInterferenceName) : nullptr;
  if (make == nullptr) {
    const char* why = dlerror();
    return Error{fmt::format(
        "interference is not measured: the module {} cannot be loaded: {}. `sudo apt install "
        "--reinstall plumbline` restores it and the libraries it needs; in a checkout run ./dev "
        "build. Then restart the daemon",
        module, why != nullptr ? why : "no reason given")};
  }
  return std::unique_ptr<Interference>(reinterpret_cast<MakeInterference*>(make)());
}

}  // namespace

status::SceneStatus SceneStatusOf(const SceneMeasurements& measured) {
  status::SceneStatus scene;
  for (const MeasuredPair& pair : measured.pairs) {
    if (pair.state == scene::Proximity::kInterference) ++scene.interferences;
    if (pair.state == scene::Proximity::kNear) ++scene.near;
    if (!pair.separation) {
      ++scene.unmeasured;
    } else if (scene.object_a == 0 || pair.separation->distance_m < scene.smallest_m) {
      scene.smallest_m = pair.separation->distance_m;
      scene.object_a = static_cast<std::uint16_t>(pair.number_a);
      scene.object_b = static_cast<std::uint16_t>(pair.number_b);
    }
  }
  for (const MeasuredSweep& sweep : measured.sweeps) {
    if (sweep.result && sweep.result->hits) ++scene.blocked;
  }
  return scene;
}

SceneMeasurer::SceneMeasurer(double near_m, log::LogSink sink)
    : near_m_(near_m), sink_(std::move(sink)) {}

SceneMeasurer::~SceneMeasurer() = default;

void SceneMeasurer::SetScene(std::shared_ptr<const SceneSnapshot> scene,
                             const std::atomic<bool>* end) {
  if (!scene || !scene->complete || scene == scene_ || unavailable_) return;
  scene_ = std::move(scene);
  Build(end);
}

bool SceneMeasurer::idle() const {
  return !scene_ || !scene_->table ||
         (scene_->table->pairs.empty() && scene_->table->distances.empty() &&
          scene_->table->points.empty() &&
          std::none_of(scene_->table->lines.begin(), scene_->table->lines.end(),
                       [](const SceneLine& line) { return line.sweep.has_value(); }));
}

void SceneMeasurer::Build(const std::atomic<bool>* end) {
  solids_.reset();
  solid_.clear();
  watches_.clear();
  sweeps_.clear();
  sweep_due_s_ = -1e300;
  if (idle()) return;
  Result<std::unique_ptr<Interference>> loaded = LoadInterference();
  if (!loaded) {
    unavailable_ = true;
    scene_.reset();
    sink_({log::Event::kViewFault, loaded.error(), {{"ABOUT", kInterferenceModuleFile}}});
    return;
  }
  solids_ = std::move(loaded).value();
  const ObjectTable& table = *scene_->table;
  for (std::size_t k = 0; k < table.objects.size(); ++k) {
    const SceneObject& object = table.objects[k];
    const MeshOfObject& mesh = scene_->meshes[k];
    if (end != nullptr && *end) return;
    solid_.push_back(
        mesh ? std::optional(solids_->Add(*mesh, object.X_KO, object.scale, object.bends))
             : std::nullopt);
  }
  placed_.assign(table.objects.size(), false);
  for (const ScenePair& pair : table.pairs) {
    watches_.emplace_back(
        scene::ProximityLimits{pair.near_m > 0 ? pair.near_m : near_m_, pair.end_m});
  }
}

bool SceneMeasurer::Place(const Carriers& carriers) {
  const ObjectTable& table = *scene_->table;
  bool any = false;
  for (std::size_t k = 0; k < table.objects.size(); ++k) {
    const auto X_WK = carriers.InWorld(table.objects[k].on);
    const bool bend_known = !table.objects[k].bends || carriers.tool.has_value();
    placed_[k] = solid_[k] && X_WK && bend_known;
    if (!placed_[k]) continue;
    solids_->Place(*solid_[k], *X_WK);
    any = true;
  }
  if (carriers.tool) solids_->Bend(carriers.tool->bend);
  return any;
}

SceneMeasurements SceneMeasurer::Measure(const MeasureInput& input, double now_s) {
  SceneMeasurements measured;
  measured.time_s = input.time_s;
  if (idle()) return measured;
  const double started_s = MonotonicSeconds();
  carriers_ = &input.carriers;
  Place(input.carriers);
  for (std::size_t k = 0; k < watches_.size(); ++k) measured.pairs.push_back(MeasurePair(k));
  for (const SceneDistance& asked : scene_->table->distances) {
    measured.distances.push_back(MeasureNamed(asked));
  }
  for (std::size_t k = 0; k < scene_->table->points.size(); ++k) {
    const auto point = ResolveEndpoint({false, k});
    measured.points.push_back({scene_->table->points[k].name, {}});
    if (point) measured.points.back().p_W = point->p_W;
  }
  if (now_s >= sweep_due_s_) MeasureSweeps(input.carriers, now_s);
  measured.sweeps = sweeps_;
  carriers_ = nullptr;
  measured.took_s = MonotonicSeconds() - started_s;
  return measured;
}

MeasuredPair SceneMeasurer::MeasurePair(std::size_t index) {
  const ObjectTable& table = *scene_->table;
  const ScenePair& pair = table.pairs[index];
  const SceneObject &a = table.objects[pair.a], &b = table.objects[pair.b];
  MeasuredPair measured{a.name, b.name, a.number, b.number, {}, {}};
  if (Ready(pair.a) && Ready(pair.b)) {
    measured.separation = solids_->Measure(*solid_[pair.a], *solid_[pair.b]);
  }
  scene::InterferenceWatch& watch = watches_[index];
  const scene::Proximity before = watch.state();
  std::optional<double> distance_m;
  if (measured.separation) distance_m = measured.separation->distance_m;
  const bool changed = watch.Update(distance_m).has_value();
  measured.state = watch.state();
  if (changed) LogTransition(measured, before);
  return measured;
}

void SceneMeasurer::LogTransition(const MeasuredPair& pair, scene::Proximity before) {
  const std::string names = pair.a + " and " + pair.b;
  const Separation& now = *pair.separation;  // an unmeasured pair has no transition
  const std::string apart = fmt::format("{:.2f} mm", 1e3 * now.distance_m);
  log::LogEntry entry{log::Event::kInterferenceEnds, "", {{"PAIR", names}}};
  if (pair.state == scene::Proximity::kInterference) {
    entry.event = log::Event::kInterferenceBegins;
    entry.text = fmt::format("interference of {} begins: {:.2f} mm deep", names, 1e3 * now.depth_m);
    entry.fields.push_back({"DEPTH_MM", fmt::format("{:.3f}", 1e3 * now.depth_m)});
  } else if (before == scene::Proximity::kInterference) {
    entry.text = fmt::format("interference of {} has ended; {} apart", names, apart);
  } else if (pair.state == scene::Proximity::kNear) {
    entry.event = log::Event::kInterferenceNear;
    entry.text = fmt::format("{} are near: {}", names, apart);
  } else {
    entry.text = fmt::format("nearness of {} has ended; {} apart", names, apart);
  }
  entry.fields.push_back({"DISTANCE_MM", fmt::format("{:.3f}", 1e3 * now.distance_m)});
  sink_(entry);
}

std::optional<SceneMeasurer::Endpoint> SceneMeasurer::ResolveEndpoint(
    const SceneDistance::End& end) const {
  const ObjectTable& table = *scene_->table;
  if (end.is_object) {
    return Ready(end.place) ? std::optional(Endpoint{end.place, {}}) : std::nullopt;
  }
  const ScenePoint& point = table.points[end.place];
  if (const auto* const object = std::get_if<std::size_t>(&point.of)) {
    if (!Ready(*object)) return std::nullopt;
    return Endpoint{std::nullopt, solids_->PointOf(*solid_[*object], point.p)};
  }
  const auto X_WK = carriers_->InWorld(std::get<Carrier>(point.of));
  return X_WK ? std::optional(Endpoint{std::nullopt, *X_WK * point.p}) : std::nullopt;
}

MeasuredDistance SceneMeasurer::MeasureNamed(const SceneDistance& asked) const {
  MeasuredDistance measured{asked.name, {}, {}, {}};
  const auto from = ResolveEndpoint(asked.from), to = ResolveEndpoint(asked.to);
  if (!from || !to) return measured;
  Separation between;
  if (from->object && to->object) {
    between = solids_->Measure(*solid_[*from->object], *solid_[*to->object], false);
  } else if (to->object) {
    between = solids_->FromPoint(from->p_W, *solid_[*to->object]);
  } else if (from->object) {
    between = solids_->FromPoint(to->p_W, *solid_[*from->object]);
    std::swap(between.p_a_W, between.p_b_W);
  } else {
    between.distance_m = (from->p_W - to->p_W).norm();
    between.p_a_W = from->p_W;
    between.p_b_W = to->p_W;
  }
  measured.distance_m = between.distance_m;
  measured.p_a_W = between.p_a_W;
  measured.p_b_W = between.p_b_W;
  return measured;
}

void SceneMeasurer::MeasureSweeps(const Carriers& carriers, double now_s) {
  const double started_s = MonotonicSeconds();
  const ObjectTable& table = *scene_->table;
  sweeps_.clear();
  for (const SceneLine& line : table.lines) {
    if (!line.sweep) continue;
    MeasuredSweep measured{line.name, {}, {}};
    const SceneSweep& sweep = *line.sweep;
    const auto X_WK = carriers.InWorld(line.on);
    std::vector<std::size_t> against, places;
    for (const std::size_t other : sweep.against) {
      if (!Ready(other)) continue;
      against.push_back(*solid_[other]);
      places.push_back(other);
    }
    if (X_WK && solid_[sweep.object] && against.size() == sweep.against.size() &&
        !against.empty()) {
      std::vector<Vec3> path_W;
      for (const Vec3& p_K : line.points_K) path_W.push_back(*X_WK * p_K);
      const Pose X_WO{X_WK->R * sweep.X_KO.R, X_WK->R * sweep.X_KO.p};
      measured.result = solids_->Sweep(*solid_[sweep.object], X_WO, path_W, against);
      measured.other = table.objects[places[measured.result->other]].name;
    }
    sweeps_.push_back(measured);
  }
  const double took_s = MonotonicSeconds() - started_s;
  sweep_due_s_ = now_s + std::max(kSweepPeriod_s, kSweepPauseFactor * took_s);
}

namespace {

constexpr std::chrono::milliseconds kLongestWait{50};
constexpr int kMeasuringNice = 10;

}  // namespace

SceneWorker::SceneWorker(std::string objects_file, std::optional<target::TagDatabase> tags,
                         double near_m, const log::LogSink& sink)
    : sink_(sink),
      loader_(std::move(objects_file), std::move(tags), sink),
      measurer_(near_m, sink),
      thread_([this] { Run(); }) {
  pthread_setname_np(thread_.native_handle(), "objects");
}

SceneWorker::~SceneWorker() {
  End();
  thread_.join();
}

void SceneWorker::End() {
  end_ = true;
  wake_.notify_one();  // the thread looks at end_ at least every kLongestWait
}

void SceneWorker::Submit(MeasureInput input) {
  {
    const std::lock_guard lock(mutex_);
    input_ = std::move(input);
  }
  wake_.notify_one();
}

std::shared_ptr<const SceneSnapshot> SceneWorker::Scene() const {
  const std::lock_guard lock(mutex_);
  return scene_;
}

std::shared_ptr<const SceneMeasurements> SceneWorker::Newest() const {
  const std::lock_guard lock(mutex_);
  return measured_;
}

void SceneWorker::Run() {
  try {
    RunUntilEnd();
  } catch (const std::exception& why) {  // of memory, or of the library that measures
    sink_(
        {log::Event::kViewFault,
         fmt::format("interference is not measured any more: {}. Check the machine's free memory, "
                     "simplify the meshes of the object table, then restart the daemon",
                     why.what()),
         {{"ABOUT", "objects"}}});
  }
  ended_ = true;
}

void SceneWorker::RunUntilEnd() {
  // On Linux this affects the calling thread only.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kMeasuringNice);
  for (;;) {
    std::optional<MeasureInput> input;
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, kLongestWait, [this] { return end_ || input_.has_value(); });
      if (end_) return;
      input.swap(input_);
    }
    const auto scene = loader_.Poll(MonotonicSeconds());
    {
      const std::lock_guard lock(mutex_);
      scene_ = scene;
    }
    const bool other = scene != taken_;
    if (input) measurer_.SetScene(scene, &end_);
    if (other) malloc_trim(0);  // loading needs many times the memory that remains in use
    taken_ = scene;
    if (!input) continue;
    auto measured =
        std::make_shared<SceneMeasurements>(measurer_.Measure(*input, MonotonicSeconds()));
    const std::lock_guard lock(mutex_);
    measured_ = std::move(measured);
  }
}

}  // namespace plumbline::cell
