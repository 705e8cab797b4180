#include "app/measure/siblings/installed_prior.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/base/text/signed_text.h"
#include "app/measure/siblings/prior_json.h"
#include "app/measure/siblings/sibling_folder.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"

namespace plumbline::measure {
namespace {

namespace fs = std::filesystem;

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
  for (const std::string& key : *key_files) {
    const Result<std::string> pem = TextOf(key);
    if (!pem) return pem.failure();
    installed.push_back({key, *pem});
  }
  if (installed.empty()) {
    return Error{fmt::format(
        "{}: cannot be verified without the plant's public key; put it into {} as *.pem", file,
        keys)};
  }
  const Result<text::VerifiedText> verified = text::Verified(*text, installed);
  if (!verified) return Error{file + ": " + verified.error()};
  return FleetPriorFromJson(verified->text).transform_error([&](const std::string& why) {
    return file + ": " + why;
  });
}

InstalledPrior FindPrior(const std::string& path, const std::string& keys,
                         const model::CellModel& cell) {
  InstalledPrior found;
  std::error_code unknown;
  const bool is_folder = fs::is_directory(path, unknown) || !fs::exists(path, unknown);
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
    if (!found.prior || prior->date >= found.prior->date) found.prior = std::move(prior).value();
  }
  return found;
}

}  // namespace plumbline::measure
