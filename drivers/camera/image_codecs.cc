#include "drivers/camera/image_codecs.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>

#include "drivers/camera/image_folder.h"

namespace plumbline::camera {
namespace {

/// The message of the dynamic loader names the missing library: the module or one of its
/// dependencies.
Error CodecsMissing(const std::string& path) {
  const char* why = dlerror();
  return Error{
      fmt::format("the image codecs {} cannot be loaded: {}. Without them only JPEG can be read. "
                  "`sudo apt install --reinstall plumbline` restores them and the libraries they "
                  "need; in a checkout run ./dev build.",
                  path, why != nullptr ? why : "no reason given")};
}

}  // namespace

Result<ImageCodecs> OpenImageCodecs(const std::string& path) {
  // OpenCV checks it against the header of each format when it is loaded; its own limit is 2^30.
  setenv("OPENCV_IO_MAX_IMAGE_PIXELS", fmt::format("{}", kMaxFilePixels).c_str(), 1);
  // RTLD_NOW: a missing symbol is reported here instead of aborting the program later.
  void* module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) return CodecsMissing(path);
  void* read = dlsym(module, kReadGreyImageName);
  if (read == nullptr) return CodecsMissing(path);
  return ImageCodecs{reinterpret_cast<ReadGreyImage*>(read)};
}

}  // namespace plumbline::camera
