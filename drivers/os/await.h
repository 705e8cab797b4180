// Waiting for an event of a file descriptor until a point in time.
#pragma once

#include <poll.h>

#include <algorithm>
#include <cerrno>

#include "drivers/clock.h"

namespace plumbline::os {

/// @return false after until_s; true on any event, also an error, which the next call reports
inline bool Await(int fd, short events, double until_s) {
  while (true) {
    const double left_s = std::max(0.0, until_s - MonotonicSeconds());
    timespec left{};
    left.tv_sec = static_cast<time_t>(left_s);
    left.tv_nsec = static_cast<long>(1e9 * (left_s - static_cast<double>(left.tv_sec)));
    pollfd waiting{fd, events, 0};
    const int ready = ppoll(&waiting, 1, &left, nullptr);
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) return true;
  }
}

}  // namespace plumbline::os
