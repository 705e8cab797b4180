// Pacing for displays without a refresh event.
#pragma once

namespace plumbline::display {

/// Due time of the next picture [s]: one period after the previous due time, so that small delays
/// do not accumulate, or one period from now if that has already passed.
inline double NextPictureDue_s(double due_s, double now_s, double period_s) {
  return due_s + period_s > now_s ? due_s + period_s : now_s + period_s;
}

}  // namespace plumbline::display
