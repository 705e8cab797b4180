#include "app/cli/lens_option.h"

#include <fmt/format.h>

#include "app/base/config/body_reader.h"
#include "app/base/config/required_file.h"
#include "app/base/config/wrong_file.h"
#include "app/cli/failure.h"
#include "app/vision/lens_files/lens_fold.h"

namespace plumbline::cli {

std::optional<vision::LensFile> ReadUsableLens(const std::string& path, bool force) {
  config::FaultList faults;
  const auto text = config::ReadRequiredFile(path, faults);
  const bool wrong = text && config::RefuseWrongFile(*text, path, config::kWantedLens, faults);
  std::cerr << config::FaultsText(faults);
  if (!text || wrong) return std::nullopt;
  const auto lens = vision::LensFromFile(*text);
  if (!lens) {
    Fail(fmt::format("{}: {}", path, lens.error()));
    return std::nullopt;
  }
  if (!lens->accepted && !force) {
    Fail(
        fmt::format("{}: this calibration was refused (accepted is not true) for the reasons "
                    "given in the file; calibrate again, or use it anyway with --force",
                    path));
    return std::nullopt;
  }
  const std::string fold = vision::FoldNote(lens->lens, lens->size);
  if (!fold.empty()) std::cerr << fmt::format("{}: note: {}\n", path, fold);
  return *lens;
}

std::optional<target::TagDatabase> ReadBodies(const std::string& path) {
  config::FaultList faults;
  const auto text = config::ReadRequiredFile(path, faults);
  auto bodies = text ? config::TagDatabaseFromText(*text, path, faults) : std::nullopt;
  std::cerr << config::FaultsText(faults);
  return bodies;
}

}  // namespace plumbline::cli
