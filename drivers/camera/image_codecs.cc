#include "drivers/camera/image_codecs.h"

#include <dlfcn.h>
#include <fmt/format.h>

namespace plumbline {
namespace {

/// What the dynamic loader reports names the library that it missed, at the module's own path or
/// behind it.
Error CodecsMissing(const std::string& path) {
  const char* why = dlerror();
  return Error{
      fmt::format("the image codecs {} cannot be loaded: {}; without them JPEG alone is read. "
                  "`sudo apt install --reinstall plumbline` restores them with the libraries they "
                  "need; in a checkout, ./dev build creates them",
                  path, why != nullptr ? why : "no reason given")};
}

}  // namespace

Result<ImageCodecs> OpenImageCodecs(const std::string& path) {
  // All symbols now: one that a library lacks is reported here and does not end the program later.
  void* module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) return CodecsMissing(path);
  void* read = dlsym(module, kReadGreyImageName);
  if (read == nullptr) return CodecsMissing(path);
  return ImageCodecs{reinterpret_cast<ReadGreyImage*>(read)};
}

}  // namespace plumbline
