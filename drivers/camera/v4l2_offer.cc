#include "drivers/camera/v4l2_offer.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/files/open_failure.h"

namespace plumbline {

Result<V4l2Offer> OfferOf(const V4l2Device& device) {
  const int fd = open(device.path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) return Error{CannotBeOpened(errno, kCameraDevice)};
  V4l2Offer offer{ModesOf(fd), ControlsOf(fd)};
  close(fd);
  return offer;
}

}  // namespace plumbline
