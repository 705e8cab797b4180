#include "app/cell/model_store/configuration_note.h"

#include <filesystem>

#include "drivers/files/replace_file.h"
#include "drivers/files/text_file.h"

namespace plumbline::cell {
namespace {

std::string RecordFile(const std::string& state_directory) {
  return state_directory + "/configuration";
}

}  // namespace

Result<void> RecordConfigurationPath(const std::string& state_directory, const std::string& file) {
  std::error_code unknown;
  const std::string path = std::filesystem::absolute(file, unknown).string();
  if (unknown || RecordedConfigurationPath(state_directory) == path) return {};
  return files::ReplaceFileDurably(RecordFile(state_directory), path + "\n");
}

bool HasBeenUsed(const std::string& state_directory) {
  std::error_code unknown;
  return std::filesystem::exists(RecordFile(state_directory), unknown) ||
         std::filesystem::exists(state_directory + "/journal.sqlite", unknown);
}

std::optional<std::string> RecordedConfigurationPath(const std::string& state_directory) {
  const Result<std::string> text = files::ReadTextFile(RecordFile(state_directory));
  if (!text) return std::nullopt;
  const std::string path = text->substr(0, text->find('\n'));
  return path.empty() ? std::nullopt : std::optional(path);
}

}  // namespace plumbline::cell
