#include "app/view/shown.h"

namespace plumbline {

void Shown::Put(std::shared_ptr<const ViewState> state) {
  const std::lock_guard lock(mutex_);
  state_ = std::move(state);
}

void Shown::Put(std::shared_ptr<const RgbImage> picture) {
  const std::lock_guard lock(mutex_);
  picture_ = std::move(picture);
}

std::shared_ptr<const ViewState> Shown::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::shared_ptr<const RgbImage> Shown::Picture(double now_s) {
  const std::lock_guard lock(mutex_);
  asked_s_ = now_s;
  return picture_;
}

bool Shown::Asked(double now_s) const {
  const std::lock_guard lock(mutex_);
  return now_s - asked_s_ < kAskedFor_s;
}

}  // namespace plumbline
