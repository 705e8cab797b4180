// ioctl() that a signal does not end.
#pragma once

#include <sys/ioctl.h>

#include <cerrno>

namespace plumbline {

/// As ioctl(), called again where a signal came in between. @return -1 with errno set on failure
inline int IoctlAgain(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

}  // namespace plumbline
