#include "drivers/camera/v4l2_capabilities.h"

#include <fcntl.h>

#include <cerrno>
#include <cstring>

#include "drivers/files/open_failure.h"
#include "drivers/os/descriptor.h"

namespace plumbline::camera {

Result<V4l2Capabilities> QueryV4l2Capabilities(const V4l2Device& device) {
  const os::Descriptor fd(open(device.path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd) return Error{files::OpenErrorText(errno, files::kCameraDevice)};
  return V4l2Capabilities{ModesOf(fd.get()), ControlsOf(fd.get())};
}

}  // namespace plumbline::camera
