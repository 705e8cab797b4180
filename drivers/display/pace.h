// When the next picture is due, for displays without a refresh of their own.
#pragma once

namespace plumbline {

/// A period after the last one was due, so that small delays do not add up; a period from now where
/// that is over already.
inline double NextPicture_s(double due_s, double now_s, double period_s) {
  return due_s + period_s > now_s ? due_s + period_s : now_s + period_s;
}

}  // namespace plumbline
