#include "app/display/view/display_mailbox.h"

#include "app/display/view/state_strip.h"
#include "app/display/view/status_text.h"

namespace plumbline::display {

DisplayStatus MakeDisplayStatus(const ViewFacts& facts, std::string picture_problem) {
  DisplayStatus now;
  now.time_s = facts.now_s;
  if (facts.state != nullptr) now.state = std::make_shared<const cell::ViewState>(*facts.state);
  now.link_problem = facts.link_problem;
  now.picture_problem = std::move(picture_problem);
  now.strip = StripOf(facts);
  now.remedy = MessageOf(DisplayedHealth(facts), facts).remedy;
  now.headline = Headline(facts);
  if (facts.state != nullptr) now.tiles = TilesOf(facts);
  now.health = DisplayedHealth(facts);
  now.panels = PanelsOf(facts);
  now.viewer_lines = facts.viewer_lines;
  if (facts.model != nullptr) {
    for (const correction::AssemblyPoint& point : facts.model->config.machine.points) {
      if (!point.name.empty()) now.point_names[point.id] = point.name;
    }
    for (const model::Joint& joint : facts.model->config.machine.cell.robot.joints) {
      now.joints.push_back(joint.type);
    }
  }
  if (facts.measured != nullptr && facts.now_s - facts.measured->time_s <= cell::kMeasuredFresh_s) {
    now.pairs = facts.measured->pairs;
  }
  now.frames_per_s = facts.frames_per_s;
  return now;
}

DisplayStatus WithdrawIfSilent(const DisplayStatus& now, double now_s) {
  DisplayStatus shown = now;
  if (now.state == nullptr) return shown;
  auto withdrawn = WithdrawnState(*now.state, now.link_problem, now_s);
  if (!withdrawn) return shown;
  shown.health = withdrawn->health;
  if (shown.headline.tone != Tone::kBad) {
    shown.remedy = RemedyOf(HealthReason::kNoDaemon);
    shown.strip = {StateClass::kUnknown, "NO DAEMON",
                   "plumbline-view receives no data from plumblined", shown.remedy};
    shown.headline = {shown.strip.Text(), Tone::kBad};
  }
  for (PointTile& tile : shown.tiles) {
    tile = {tile.id, tile.name, StateClass::kAlarm, "not valid", Describe(HealthReason::kNoDaemon),
            ""};
  }
  shown.state = std::make_shared<const cell::ViewState>(*std::move(withdrawn));
  return shown;
}

void DisplayMailbox::Publish(std::shared_ptr<const DisplayStatus> status) {
  const std::lock_guard lock(mutex_);
  status_ = std::move(status);
}

void DisplayMailbox::Publish(std::shared_ptr<const DisplayPicture> picture) {
  const std::lock_guard lock(mutex_);
  if (picture) current_s_ = picture->time_s;
  picture_ = std::move(picture);
}

void DisplayMailbox::ConfirmPicture(double now_s) {
  const std::lock_guard lock(mutex_);
  current_s_ = now_s;
}

double DisplayMailbox::picture_current_s() const {
  const std::lock_guard lock(mutex_);
  return current_s_;
}

std::shared_ptr<const DisplayStatus> DisplayMailbox::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

std::shared_ptr<const DisplayPicture> DisplayMailbox::picture() const {
  const std::lock_guard lock(mutex_);
  return picture_;
}

std::shared_ptr<const DisplayPicture> DisplayMailbox::RequestPicture(double now_s) {
  const std::lock_guard lock(mutex_);
  requested_s_ = now_s;
  return picture_;
}

bool DisplayMailbox::PictureRequested(double now_s) const {
  const std::lock_guard lock(mutex_);
  return now_s - requested_s_ < kPictureRequestLifetime_s;
}

}  // namespace plumbline::display
