#include "app/display/view_process/viewer.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/log/log.h"
#include "app/display/view_process/view_entries.h"
#include "drivers/clock.h"

namespace plumbline::display {
namespace {

constexpr double kRateShare = 0.1;  ///< weight of the newest interval in the mean frame rate

std::optional<target::TagDatabase> TagsOf(const cell::ViewModel& model) {
  if (model.config.vision.cameras.empty()) return std::nullopt;
  return model.config.vision.tags.database;
}

}  // namespace

Viewer::Viewer(std::string config_file, cell::ViewModel model, log::LogSink sink)
    : config_file_(std::move(config_file)),
      sink_(std::move(sink)),
      model_(std::move(model)),
      overlay_(model_->config.overlay),
      state_directory_(model_->config.state_directory),
      client_(cell::ViewSocketOf(state_directory_)) {
  StartSceneWorker();
}

void Viewer::StartSceneWorker() {
  worker_.reset();
  // The daemon loads the same files and logs what is wrong with them.
  worker_.emplace(overlay_.objects_file, TagsOf(*model_), overlay_.near_m,
                  [](const log::LogEntry&) {});
}

bool Viewer::Read(double timeout_s) {
  const bool came = client_.Read(timeout_s, view_);
  const std::string& problem = client_.problem();
  const bool lost = !came && !problem.empty() && !client_.connected();
  if (lost && link_problem_.empty())
    sink_({log::Event::kViewLinkLost, fmt::format("{} (socket {})", problem, client_.path())});
  if (came && !link_problem_.empty())
    sink_({log::Event::kViewLinkBack, "receiving data from plumblined again"});
  if (lost) link_problem_ = problem;
  if (!came) return false;
  link_problem_.clear();
  const cell::ViewState& state = view_.state;
  const bool first = !has_state_ && model_ && model_->version == state.model_version;
  has_state_ = true;
  if (!first && generation_ != state.generation) LoadModel();
  generation_ = state.generation;
  tracks_.resize(std::max<std::size_t>(1, state.cameras.size()));
  CountFrames();
  UpdateCarriers(MonotonicSeconds());
  return true;
}

void Viewer::CountFrames() {
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    CameraTrack& track = tracks_[k];
    const auto& image = cell::CameraOf(view_.state, k).image;
    if (!image || image->sequence == track.sequence) continue;
    const double interval_s = image->time_s - track.image_s;
    const double count = static_cast<double>(image->sequence - track.sequence);
    if (track.image_s > 0 && interval_s > 0 && image->sequence > track.sequence) {
      const double rate = std::min(count / interval_s, 1000.0);
      track.frames_per_s += (track.frames_per_s > 0 ? kRateShare : 1) * (rate - track.frames_per_s);
    }
    track.image_s = image->time_s;
    track.sequence = image->sequence;
  }
}

double Viewer::image_interval_s() const {
  double images_per_s = 0;
  for (const CameraTrack& track : tracks_) images_per_s += track.frames_per_s;
  return 1 / images_per_s;
}

void Viewer::UpdateCarriers(double now_s) {
  carriers_.clear();
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    const cell::ViewModel* const model = model_ ? &*model_ : nullptr;
    carriers_.push_back(tracks_[k].memory.Update(view_.state, k, model, now_s));
  }
  cell::ShareDetections(carriers_);
  if (view_.state.cameras.empty() && model_) {
    const Pose X_CW = viewpoint_.Update(view_.state, *model_);
    carriers_.front() = SeenFrom(X_CW, carriers_.front(), *model_);
  }
}

std::vector<const std::uint8_t*> Viewer::Pixels() const {
  std::vector<const std::uint8_t*> pixels;
  for (const cell::View::Pixels& image : view_.pixels) {
    pixels.push_back(image.bytes.empty() ? nullptr : image.bytes.data());
  }
  return pixels;
}

std::vector<const scene::MeshFacts*> Viewer::MeshFacts() const {
  std::vector<const scene::MeshFacts*> facts;
  facts.reserve(scene_->meshes.size());
  for (const cell::MeshOfObject& mesh : scene_->meshes)
    facts.push_back(mesh ? &mesh->facts : nullptr);
  return facts;
}

void Viewer::LoadModel() {
  const int version = view_.state.model_version;
  config::FaultList faults;
  std::optional<cell::ViewModel> fresh = cell::ReadViewModel(config_file_, version, faults);
  if (!fresh) {
    for (const config::Fault& fault : faults.All()) sink_(log::LogEntryFromFault(fault));
    model_.reset();  // never draw the tool of another model version
    return;
  }
  const bool same = model_ && model_->version == version;
  sink_(ViewNote(same || version == 0 ? "plumblined has read its configuration again"
                                      : fmt::format("showing model version {}", version)));
  model_ = std::move(fresh);
}

void Viewer::Reload() {
  config::FaultList faults;
  const int version = has_state_ ? view_.state.model_version : 0;
  std::optional<cell::ViewModel> fresh = cell::ReadViewModel(config_file_, version, faults);
  for (const config::Fault& fault : faults.All()) sink_(log::LogEntryFromFault(fault));
  if (!fresh) {
    sink_({log::Event::kNotReloaded,
           "configuration not reloaded; the previous one stays in force. Fix the faults logged "
           "above"});
    return;
  }
  model_ = std::move(fresh);
  overlay_ = model_->config.overlay;
  StartSceneWorker();
  sink_({log::Event::kReloaded, fmt::format("configuration {} reloaded", config_file_)});
}

const display::ViewFacts& Viewer::Facts() {
  scene_ = worker_->Scene();
  facts_ = {};
  facts_.now_s = MonotonicSeconds();
  facts_.link_problem = link_problem_.empty() && !has_state_ ? client_.problem() : link_problem_;
  for (const cell::SceneRemark& remark : scene_->remarks) {
    facts_.objects.push_back({remark.text, remark.fault ? Tone::kBad : Tone::kAttention});
  }
  facts_.table = scene_->table ? &*scene_->table : nullptr;
  facts_.model = model_ ? &*model_ : nullptr;
  for (const log::LogLine& line : log::RecentLog()) {
    facts_.viewer_lines.push_back(
        {line.number, line.utc_s, static_cast<int>(line.level), line.text});
  }
  if (!has_state_) return facts_;
  // Data become stale with time even if no state arrives.
  UpdateCarriers(facts_.now_s);
  facts_.state = &view_.state;
  facts_.measured = view_.state.scene ? &*view_.state.scene : nullptr;
  facts_.carriers = carriers_;
  facts_.shown.clear();
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    facts_.frames_per_s.push_back(tracks_[k].frames_per_s);
    const bool other =
        overlay_.camera && cell::CameraOf(view_.state, k).status.name != *overlay_.camera;
    if (!other) facts_.shown.push_back(k);
  }
  // After a reload the daemon may not have the configured camera until it is restarted.
  if (facts_.shown.empty()) facts_.shown = {0};
  return facts_;
}

}  // namespace plumbline::display
