// ioctl() with retry on EINTR.
#pragma once

#include <sys/ioctl.h>

#include <cerrno>

namespace plumbline {

/// ioctl(), repeated while signals interrupt it. @return  -1 with errno set on failure
inline int IoctlAgain(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

}  // namespace plumbline
