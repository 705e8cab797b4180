#include "app/vision/print/sheet_writer.h"

#include <dlfcn.h>
#include <fmt/format.h>

namespace plumbline::vision {
namespace {

/// The message of the dynamic loader names the missing library: the module or one of its
/// dependencies.
Error ModuleMissing(const std::string& path) {
  const char* why = dlerror();
  return Error{fmt::format(
      "the module that draws sheets, {}, cannot be loaded: {}. `sudo apt install --reinstall "
      "plumbline` restores it and the libraries it needs; in a checkout run ./dev build.",
      path, why != nullptr ? why : "no reason given")};
}

void AppendBytes(void* file, const unsigned char* bytes, std::size_t count) {
  static_cast<std::string*>(file)->append(reinterpret_cast<const char*>(bytes), count);
}

}  // namespace

Result<std::string> FileOfSheets(const Document& document, SheetFormat format,
                                 const std::string& module) {
  // RTLD_NOW: a missing symbol is reported here instead of aborting the program later.
  void* const loaded = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (loaded == nullptr) return ModuleMissing(module);
  void* const draw = dlsym(loaded, kDrawSheetsName);
  if (draw == nullptr) return ModuleMissing(module);
  std::string file;
  if (const char* fault =
          reinterpret_cast<DrawSheets*>(draw)(document, format, AppendBytes, &file)) {
    return Error{
        fmt::format("the sheets cannot be drawn: cairo reports \"{}\". Check that "
                    "fonts-dejavu-core is installed.",
                    fault)};
  }
  return file;
}

}  // namespace plumbline::vision
