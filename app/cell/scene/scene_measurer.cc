#include "app/cell/scene/scene_measurer.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>

#include "drivers/clock.h"
#include "drivers/files/package_paths.h"
#include "firmware-like/result.h"

namespace plumbline::cell {
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

}  // namespace plumbline::cell
