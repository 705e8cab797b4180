#include "app/measure/siblings/installed_prior.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <tuple>

#include "app/base/text/signed_text.h"
#include "app/base/text/text.h"
#include "app/measure/siblings/prior_json.h"
#include "app/measure/siblings/sibling_folder.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"

namespace plumbline::measure {
namespace {

namespace fs = std::filesystem;

constexpr double kClocksApart_s = 3600;  // of plant and cell, at most

/// The files of a folder with this extension, sorted; none if it does not exist.
Result<std::vector<std::string>> FilesIn(const std::string& folder, std::string_view extension) {
  std::vector<std::string> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() == extension) files.push_back(at->path().string());
  }
  if (error && error != std::errc::no_such_file_or_directory)
    return Error{fmt::format("{}: {}", folder, files::ReadErrorText(folder, error.message()))};
  std::ranges::sort(files);
  return files;
}

Result<std::string> TextOf(const std::string& file) {
  Result<std::string> text = files::ReadTextFile(file);
  if (!text) return Error{fmt::format("{}: {}", file, files::ReadErrorText(file, text.error()))};
  return text;
}

}  // namespace

Result<FleetPrior> ReadPrior(const std::string& file, const std::string& keys) {
  const Result<std::string> text = TextOf(file);
  if (!text) return text.failure();
  const Result<std::vector<std::string>> key_files = FilesIn(keys, ".pem");
  if (!key_files) return key_files.failure();
  std::vector<text::PublicKey> installed;
  std::string unreadable;
  for (const std::string& key : *key_files) {
    const Result<std::string> pem = TextOf(key);
    if (pem) {
      installed.push_back({key, *pem});
    } else {
      unreadable += "; " + pem.error();
    }
  }
  if (installed.empty()) {
    return Error{fmt::format(
        "{}: cannot be verified without the plant's public key; put it into {} as *.pem{}", file,
        keys, unreadable)};
  }
  const Result<text::VerifiedText> verified = text::Verified(*text, installed);
  if (!verified) return Error{file + ": " + verified.error() + unreadable};
  Result<FleetPrior> prior = FleetPriorFromJson(verified->text);
  if (!prior) return Error{file + ": " + prior.error()};
  if (!IsOfPast(*prior, kClocksApart_s))
    return Error{fmt::format("{}: was created at {}, in the future; set the clock of this computer",
                             file, prior->created)};
  return prior;
}

bool IsOfPast(const FleetPrior& prior, double tolerance_s) {
  const double latest_s = text::UtcFromText(text::TextOfUtcNow()).value_or(0) + tolerance_s;
  return text::UtcFromText(prior.date + "T00:00:00Z").value_or(0) <= latest_s &&
         text::UtcFromText(prior.created).value_or(0) <= latest_s;
}

InstalledPrior FindPrior(const std::string& path, const std::string& keys,
                         const model::CellModel& cell) {
  InstalledPrior found;
  std::error_code unknown;
  const bool exists = fs::exists(path, unknown);
  if (!exists && path != kPriorFolder) {
    found.problems.push_back(path +
                             ": does not exist; give a signed prior, or a folder of *.prior");
    return found;
  }
  const bool is_folder = !exists || fs::is_directory(path, unknown);
  const Result<std::vector<std::string>> files =
      is_folder ? FilesIn(path, ".prior") : Result(std::vector{path});
  if (!files) {
    found.problems.push_back(files.error());
    return found;
  }
  const std::string& model = cell.robot.identity.model;
  for (const std::string& file : *files) {
    Result<FleetPrior> prior = ReadPrior(file, keys);
    if (!prior) {
      found.problems.push_back(prior.error());
      continue;
    }
    if (prior->model != model) {
      if (is_folder) continue;
      found.problems.push_back(
          fmt::format("{}: is the prior of {}; the cell file names {}: check [robot] model", file,
                      prior->model, model.empty() ? "no arm model" : model));
      continue;
    }
    if (const std::string difference = DifferenceOf(prior->cell, cell); !difference.empty()) {
      found.problems.push_back(
          fmt::format("{}: this cell is not declared like the {} arms of the prior: {}", file,
                      prior->arms.size(), difference));
      continue;
    }
    const auto time = [](const FleetPrior& one) { return std::tie(one.date, one.created); };
    if (!found.prior || time(*prior) >= time(*found.prior)) found.prior = std::move(prior).value();
  }
  return found;
}

}  // namespace plumbline::measure
