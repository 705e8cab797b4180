#include "app/model_store/model_store.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <utility>

#include "app/config/daemon_config.h"
#include "app/config/text_file.h"
#include "app/model_store/durable_file.h"
#include "app/model_store/model_json.h"
#include "drivers/files/open_failure.h"

namespace plumbline {
namespace {

/// A file that only a newer version understands is left as it is.
std::optional<Error> WrittenByNewer(const std::string& path, const std::string& text) {
  const int schema = SchemaInJson(text);
  if (schema <= kModelSchema) return std::nullopt;
  return Error{
      fmt::format("{}: written by a newer plumbline (schema {}, this one knows {}); install that "
                  "version again, or move the folder away to begin a new one",
                  path, schema, kModelSchema)};
}

}  // namespace

std::string ModelCommand(const std::string& words, const std::string& state_directory) {
  return fmt::format("`plumbline model {}{}`", words,
                     state_directory == kUsualStateDirectory ? "" : " --state " + state_directory);
}

Result<ModelStore> ModelStore::Open(const std::string& state_directory) {
  ModelStore store(state_directory + "/models");
  std::error_code error;
  std::filesystem::create_directories(store.folder_, error);
  if (error)
    return Error{fmt::format("{}: cannot be made: {}{}", store.folder_, error.message(),
                             WriteRemedy(store.folder_))};
  return store;
}

std::string ModelStore::Path(int number, const char* suffix) const {
  return fmt::format("{}/{:04}{}", folder_, number, suffix);
}
std::string ModelStore::ModelFile(int number) const {
  return Path(number, ".toml");
}
std::string ModelStore::ReportFile(int number) const {
  return Path(number, ".html");
}

std::vector<int> ModelStore::Numbers() const {
  std::vector<int> numbers;
  std::error_code ignored;  // an unreadable folder has no versions; told when one is asked for
  for (const auto& entry : std::filesystem::directory_iterator(folder_, ignored)) {
    if (entry.path().extension() != ".json") continue;
    const std::string stem = entry.path().stem().string();
    int number = 0;
    const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
    if (error == std::errc() && end == stem.data() + stem.size() && number > 0) {
      numbers.push_back(number);
    }
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

Result<ModelState> ModelStore::State() const {
  const std::string path = folder_ + "/state.json";
  if (!std::filesystem::exists(path)) return ModelState{};
  const Result<std::string> text = ReadTextFile(path);
  if (!text) return Error{fmt::format("{}: {}", path, CannotBeRead(path, text.error()))};
  if (auto newer = WrittenByNewer(path, *text)) return *std::move(newer);
  const std::optional<ModelState> state = ModelStateFromJson(*text);
  if (!state) {
    return Error{
        fmt::format("{}: is not a state of the model store; move it away, then choose by "
                    "`plumbline model apply N`",
                    path)};
  }
  return *state;
}

Result<ModelFacts> ModelStore::Facts(int number) const {
  const std::string path = Path(number, ".json");
  const Result<std::string> text = ReadTextFile(path);
  if (!text)
    return Error{
        fmt::format("no version {}: {}: {}", number, path, CannotBeRead(path, text.error()))};
  if (auto newer = WrittenByNewer(path, *text)) return *std::move(newer);
  const std::optional<ModelFacts> facts = ModelFactsFromJson(*text);
  if (!facts) return Error{fmt::format("{}: is not what the model store wrote", path)};
  return *facts;
}

Result<std::vector<ModelVersion>> ModelStore::Versions() const {
  std::vector<ModelVersion> versions;
  for (const int number : Numbers()) {
    Result<ModelFacts> facts = Facts(number);
    if (!facts) return Error{facts.error()};
    versions.push_back({number, std::move(facts).value()});
  }
  return versions;
}

Result<std::string> ModelStore::Text(int number) const {
  const Result<ModelFacts> facts = Facts(number);  // a model without facts was not completed
  if (!facts) return Error{facts.error()};
  const Result<std::string> text = ReadTextFile(ModelFile(number));
  if (!text)
    return Error{
        fmt::format("{}: {}", ModelFile(number), CannotBeRead(ModelFile(number), text.error()))};
  return *text;
}

Result<int> ModelStore::AddVersion(const std::string& text, const ModelFacts& facts,
                                   const std::string& report) {
  const std::vector<int> numbers = Numbers();
  const int number = numbers.empty() ? 1 : numbers.back() + 1;
  ModelFacts complete = facts;
  if (!report.empty()) {
    const Result<std::string> content = ReadTextFile(report);
    if (!content)
      return Error{fmt::format("{}: {}", report, CannotBeRead(report, content.error()))};
    const Result<bool> kept = WriteDurably(ReportFile(number), *content, 0444);
    if (!kept) return Error{kept.error()};
    complete.report = std::filesystem::path(ReportFile(number)).filename().string();
  }
  const Result<bool> model = WriteDurably(ModelFile(number), text, 0444);
  if (!model) return Error{model.error()};
  const Result<bool> described = WriteDurably(Path(number, ".json"), JsonFrom(complete), 0444);
  if (!described) return Error{described.error()};
  return number;
}

Result<bool> ModelStore::WriteState(const ModelState& state) {
  return WriteDurably(folder_ + "/state.json", JsonFrom(state));
}

Result<int> ModelStore::Declare(const std::string& text, const std::string& file) {
  const Result<FileLock> lock = FileLock::Take(folder_ + "/lock", FileLock::Wait::kYes);
  if (!lock) return Error{lock.error()};
  Result<ModelState> state = State();
  if (!state) return Error{state.error()};
  if (state->declared != 0) {
    const Result<std::string> former = Text(state->declared);
    if (former && *former == text) return state->declared;
  }
  ModelFacts facts;
  facts.origin = ModelFacts::Origin::kDeclared;
  facts.date = UtcNow();
  facts.from = file;
  Result<int> number = AddVersion(text, facts, "");
  if (!number) return number;
  state.value().declared = *number;
  state.value().applied = *number;
  state.value().proposed = 0;  // it was made for another cell
  state.value().history.push_back(*number);
  const Result<bool> kept = WriteState(*state);
  if (!kept) return Error{kept.error()};
  return *number;
}

Result<int> ModelStore::Propose(const std::string& text, ModelFacts facts,
                                const std::string& report) {
  const Result<FileLock> lock = FileLock::Take(folder_ + "/lock", FileLock::Wait::kYes);
  if (!lock) return Error{lock.error()};
  Result<ModelState> state = State();
  if (!state) return Error{state.error()};
  if (facts.date.empty()) facts.date = UtcNow();
  if (!facts.based_on && state->applied != 0) facts.based_on = state->applied;
  Result<int> number = AddVersion(text, facts, report);
  if (!number) return number;
  state.value().proposed = *number;
  const Result<bool> kept = WriteState(*state);
  if (!kept) return Error{kept.error()};
  return *number;
}

Result<bool> ModelStore::Apply(int number) {
  const Result<FileLock> lock = FileLock::Take(folder_ + "/lock", FileLock::Wait::kYes);
  if (!lock) return Error{lock.error()};
  Result<ModelState> state = State();
  if (!state) return Error{state.error()};
  const Result<std::string> text = Text(number);
  if (!text) return Error{text.error()};
  state.value().proposed = 0;
  if (state->applied != number) {
    state.value().applied = number;
    state.value().history.push_back(number);
  }
  return WriteState(*state);
}

Result<int> ModelStore::RollBack() {
  const Result<FileLock> lock = FileLock::Take(folder_ + "/lock", FileLock::Wait::kYes);
  if (!lock) return Error{lock.error()};
  Result<ModelState> state = State();
  if (!state) return Error{state.error()};
  std::vector<int>& history = state.value().history;
  if (history.size() < 2) return Error{"no version was in force before the present one"};
  history.pop_back();
  state.value().applied = history.back();
  const Result<std::string> text = Text(history.back());
  if (!text) return Error{text.error()};
  const Result<bool> kept = WriteState(*state);
  if (!kept) return Error{kept.error()};
  return state->applied;
}

const char* NameOf(ModelFacts::Origin origin) {
  switch (origin) {
    case ModelFacts::Origin::kDeclared:
      return "declared";
    case ModelFacts::Origin::kDiagnosis:
      return "diagnosis";
    case ModelFacts::Origin::kManual:
      return "manual";
  }
  return "?";
}

std::string UtcNow() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}Z", fmt::gmtime(std::time(nullptr)));
}

}  // namespace plumbline
