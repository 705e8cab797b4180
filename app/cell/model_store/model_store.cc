#include "app/cell/model_store/model_store.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <utility>

#include "app/base/config/daemon_config.h"
#include "app/base/text/text.h"
#include "app/cell/model_store/cell_difference.h"
#include "app/cell/model_store/model_json.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/replace_file.h"
#include "drivers/files/text_file.h"

namespace plumbline::cell {
namespace {

constexpr std::size_t kMaxShownChanges = 4;

}  // namespace

std::vector<std::string> Abbreviated(std::vector<std::string> texts, std::size_t max_count) {
  if (texts.size() <= max_count) return texts;
  const std::size_t more = texts.size() - max_count;
  texts.resize(max_count);
  texts.push_back(fmt::format("and {} more", more));
  return texts;
}

std::string SupersededText(const ModelState& state, const std::string& state_directory) {
  const SupersededVersion& aside = *state.set_aside;
  if (aside.version == 0) {
    const std::string confirm =
        state.applied == 0
            ? ""
            : fmt::format(", or confirm the cell file with {}",
                          ModelCommand(fmt::format("apply {}", state.applied), state_directory));
    return fmt::format(
        "the model store {0}/models was found empty, although this state directory was used "
        "before: a previously applied model, if there was one, is not in force, and points are "
        "corrected by the cell file. Restore {0}/models from the backup and restart the daemon "
        "(`systemctl restart plumbline`){1}",
        state_directory, confirm);
  }
  const std::string why =
      aside.changes.empty()
          ? "the cell file was changed, and then changed back"
          : fmt::format("the cell file changed since: {}",
                        fmt::join(Abbreviated(aside.changes, kMaxShownChanges), "; "));
  const std::string withdrawn =
      aside.withdrawn == 0
          ? ""
          : fmt::format(" The proposed version {} was withdrawn.", aside.withdrawn);
  return fmt::format(
      "model version {} is set aside: {}. Points are corrected by the cell file (version {}), "
      "without the effects that version {} adds.{} {} applies version {} anyway, {} confirms the "
      "cell file",
      aside.version, why, state.applied, aside.version, withdrawn,
      ModelCommand(fmt::format("apply {}", aside.version), state_directory), aside.version,
      ModelCommand(fmt::format("apply {}", state.applied), state_directory));
}

namespace {

constexpr std::size_t kMaxStoredChanges = 50;

/// An error if a newer version has written the file, which must not be changed then.
Result<void> CheckSchema(const std::string& path, const std::string& text) {
  const int schema = SchemaInJson(text);
  if (schema <= kModelSchema) return {};
  return Error{
      fmt::format("{}: written by a newer plumbline (schema {}, this one knows {}); install that "
                  "version again, or move the folder away to start a new one",
                  path, schema, kModelSchema)};
}

std::vector<std::string> ChangesSince(const Result<std::string>& then, const std::string& now) {
  if (!then) return {"unknown: " + then.error()};
  return Abbreviated(CellTextDifferences(*then, now), kMaxStoredChanges);
}

/// After a person has chosen a version: the edit can no longer be refused, unless it was before.
void ForgetEdit(ModelState& state) {
  if (state.applied == state.declared || state.Accepted() == state.declared) state.edit.reset();
}

}  // namespace

std::string ModelCommand(const std::string& words, const std::string& state_directory) {
  return fmt::format(
      "`plumbline model {}{}`", words,
      state_directory == config::kDefaultStateDirectory ? "" : " --state " + state_directory);
}

Result<ModelStore> ModelStore::Open(const std::string& state_directory) {
  ModelStore store(state_directory + "/models");
  std::error_code error;
  std::filesystem::create_directories(store.folder_, error);
  if (error) {
    return Error{fmt::format("{}: cannot be created: {}{}", store.folder_, error.message(),
                             files::WriteRemedy(store.folder_))};
  }
  static_cast<void>(std::filesystem::directory_iterator(store.folder_, error));
  if (error) {
    return Error{
        fmt::format("{}: {}", store.folder_, files::ReadErrorText(store.folder_, error.message()))};
  }
  return store;
}

std::string ModelStore::Path(int number, const char* suffix) const {
  return fmt::format("{}/{:04}{}", folder_, number, suffix);
}
std::string ModelStore::ModelFile(int number) const {
  return Path(number, ".toml");
}
std::string ModelStore::ModelFile(const std::string& state_directory, int number) {
  return ModelStore(state_directory + "/models").ModelFile(number);
}
std::string ModelStore::ReportFile(int number) const {
  return Path(number, ".html");
}

Result<std::vector<int>> ModelStore::Numbers() const {
  std::vector<int> numbers;
  std::error_code failed;
  std::filesystem::directory_iterator entry(folder_, failed);
  for (; !failed && entry != std::filesystem::directory_iterator(); entry.increment(failed)) {
    if (entry->path().extension() != ".json") continue;
    const std::string stem = entry->path().stem().string();
    int number = 0;
    const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
    if (error == std::errc() && end == stem.data() + stem.size() && number > 0) {
      numbers.push_back(number);
    }
  }
  if (failed) {  // not considered empty: unlisted versions must not be overwritten
    return Error{fmt::format("{}: {}", folder_, files::ReadErrorText(folder_, failed.message()))};
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

Result<ModelState> ModelStore::State() const {
  bool damaged = false;
  return ReadState(damaged);
}

Result<ModelState> ModelStore::ReadState(bool& damaged) const {
  const std::string path = StateFile();
  const auto lost = [&](const std::string& what) {
    damaged = true;
    const std::string directory = std::filesystem::path(folder_).parent_path().string();
    return Error{fmt::format(
        "{}: {}, so it is unknown which model was in force, and the cell file is not used in its "
        "place; {} lists the versions, {} puts one in force and rewrites the file",
        path, what, ModelCommand("list", directory), ModelCommand("apply N", directory))};
  };
  std::error_code hidden;
  const auto type = std::filesystem::symlink_status(path, hidden).type();
  if (type == std::filesystem::file_type::not_found) {
    const Result<std::vector<int>> numbers = Numbers();
    if (!numbers) return numbers.failure();
    if (numbers->empty()) return ModelState{};
    return lost(fmt::format("is missing, but there {} {} version{}",
                            numbers->size() == 1 ? "is" : "are", numbers->size(),
                            numbers->size() == 1 ? "" : "s"));
  }
  if (type == std::filesystem::file_type::none) {
    return lost(files::ReadErrorText(path, hidden.message()));
  }
  const Result<std::string> text = files::ReadTextFile(path);
  if (!text) return lost(files::ReadErrorText(path, text.error()));
  if (const Result<void> known = CheckSchema(path, *text); !known) return known.failure();
  const std::optional<ModelState> state = ModelStateFromJson(*text);
  if (!state) return lost(text->empty() ? "is empty" : "is damaged");
  return *state;
}

Result<int> ModelStore::NewestDeclared() const {
  const Result<std::vector<int>> numbers = Numbers();
  if (!numbers) return numbers.failure();
  for (auto number = numbers->rbegin(); number != numbers->rend(); ++number) {
    const Result<ModelFacts> facts = Facts(*number);
    if (facts && facts->origin == ModelFacts::Origin::kDeclared) return *number;
  }
  return 0;
}

Result<ModelFacts> ModelStore::Facts(int number) const {
  const std::string path = Path(number, ".json");
  const Result<std::string> text = files::ReadTextFile(path);
  if (!text)
    return Error{fmt::format("no version {}: {}: {}", number, path,
                             files::ReadErrorText(path, text.error()))};
  if (const Result<void> known = CheckSchema(path, *text); !known) return known.failure();
  const std::optional<ModelFacts> facts = ModelFactsFromJson(*text);
  if (!facts) return Error{fmt::format("{}: was not written by the model store", path)};
  return *facts;
}

Result<std::vector<ModelVersion>> ModelStore::Versions() const {
  const Result<std::vector<int>> numbers = Numbers();
  if (!numbers) return numbers.failure();
  std::vector<ModelVersion> versions;
  for (const int number : *numbers) {
    Result<ModelFacts> facts = Facts(number);
    if (!facts) return facts.failure();
    versions.push_back({number, std::move(facts).value()});
  }
  return versions;
}

Result<std::string> ModelStore::Text(int number) const {
  const Result<ModelFacts> facts = Facts(number);  // a model without facts is incomplete
  if (!facts) return facts.failure();
  const Result<std::string> text = files::ReadTextFile(ModelFile(number));
  if (!text)
    return Error{fmt::format("{}: {}", ModelFile(number),
                             files::ReadErrorText(ModelFile(number), text.error()))};
  return *text;
}

Result<int> ModelStore::AddVersion(const std::string& text, const ModelFacts& facts,
                                   const std::string& report) {
  const Result<std::vector<int>> numbers = Numbers();
  if (!numbers) return numbers.failure();
  const int number = numbers->empty() ? 1 : numbers->back() + 1;
  // A model or report without facts belongs to an incomplete version and may be overwritten; facts
  // may not.
  std::error_code hidden;
  const std::string described_by = Path(number, ".json");
  const auto type = std::filesystem::symlink_status(described_by, hidden).type();
  if (type != std::filesystem::file_type::not_found) {
    return Error{fmt::format(
        "{}: {}, and a version is never overwritten; check the folder (ls -l {}; journalctl -k) "
        "and try again",
        described_by,
        type == std::filesystem::file_type::none ? "cannot be checked: " + hidden.message()
                                                 : "exists, but was not listed",
        folder_)};
  }
  ModelFacts complete = facts;
  if (!report.empty()) {
    const Result<std::string> content = files::ReadFileUpTo(files::kTableSize, report);
    if (!content)
      return Error{fmt::format("{}: {}", report, files::ReadErrorText(report, content.error()))};
    const Result<void> kept = files::ReplaceFileDurably(ReportFile(number), *content, 0444);
    if (!kept) return kept.failure();
    complete.report = std::filesystem::path(ReportFile(number)).filename().string();
  }
  const Result<void> model = files::ReplaceFileDurably(ModelFile(number), text, 0444);
  if (!model) return model.failure();
  const Result<void> described = files::ReplaceFileDurably(described_by, JsonFrom(complete), 0444);
  if (!described) return described.failure();
  return number;
}

Result<void> ModelStore::WriteState(const ModelState& state) {
  return files::ReplaceFileDurably(StateFile(), JsonFrom(state));
}

Result<void> ModelStore::InitializeState() {
  std::error_code hidden;
  if (std::filesystem::exists(StateFile(), hidden) || hidden) return {};
  return WriteState({});
}

Result<int> ModelStore::Declare(const std::string& text, const std::string& file,
                                Expected expected) {
  std::map<int, bool> compared;  // a version never changes, so each is parsed once
  const auto describes_same_cell = [&](int version) {
    const auto [found, is_new] = compared.try_emplace(version, false);
    if (is_new && version != 0) {
      const Result<std::string> known = Text(version);
      found->second = known && CellTextDifferences(*known, text).empty();
    }
    return found->second;
  };
  {  // without the lock, which a full or read-only disk could not provide
    const Result<ModelState> present = State();
    if (present && describes_same_cell(present->declared)) return present->declared;
  }
  const Result<files::FileLock> lock = files::FileLock::Take(folder_ + "/lock", lock_wait_);
  if (!lock) return lock.failure();
  Result<ModelState> read = State();
  if (!read) return read.failure();
  ModelState state = std::move(read).value();
  if (describes_same_cell(state.declared)) return state.declared;
  if (state.Accepted() != state.declared) {  // the refused edit was undone, or replaced by another
    state.declared = state.Accepted();
    state.edit.reset();
  }
  for (const int known : {state.declared, state.applied}) {
    if (!describes_same_cell(known)) continue;
    state.declared = known;
    const Result<void> stored = WriteState(state);
    if (!stored) return stored.failure();
    return known;
  }
  const bool lost = expected == Expected::kVersions && state == ModelState{};
  const Result<void> initialized = InitializeState();
  if (!initialized) return initialized.failure();
  ModelFacts facts;
  facts.origin = ModelFacts::Origin::kDeclared;
  facts.date = text::TextOfUtcNow();
  facts.from = file;
  const Result<int> number = AddVersion(text, facts, "");
  if (!number) return number;

  if (state.declared == 0 && state.applied != 0) {  // applied before any cell file was recorded
    state.declared = *number;
    const Result<void> stored = WriteState(state);
    if (!stored) return stored.failure();
    return *number;
  }
  if (lost) state.set_aside = SupersededVersion{0, *number, {}, 0};
  const bool was_set_aside = state.set_aside.has_value();
  if (!was_set_aside && state.applied != state.declared) {
    state.set_aside = SupersededVersion{state.applied, state.declared, {}, 0};
  }
  if (state.set_aside && !lost) {
    SupersededVersion& aside = *state.set_aside;
    aside.changes = ChangesSince(Text(aside.declared), text);
    if (state.proposed != 0) aside.withdrawn = state.proposed;
  }
  // A person chose none of the versions declared since: a rollback skips them.
  if (was_set_aside && !state.history.empty()) state.history.pop_back();
  state.history.push_back(*number);
  if (state.declared != 0) state.edit = CellEdit{.withdrawn = state.proposed};
  state.declared = *number;
  state.applied = *number;
  state.confirmed = false;
  state.proposed = 0;  // it was computed for another cell
  const Result<void> stored = WriteState(state);
  if (!stored) return stored.failure();
  return *number;
}

Result<int> ModelStore::Propose(const std::string& text, ModelFacts facts,
                                const std::string& report) {
  const Result<files::FileLock> lock = files::FileLock::Take(folder_ + "/lock", lock_wait_);
  if (!lock) return lock.failure();
  Result<ModelState> state = State();
  if (!state) return state.failure();
  const Result<void> initialized = InitializeState();
  if (!initialized) return initialized.failure();
  if (facts.date.empty()) facts.date = text::TextOfUtcNow();
  if (!facts.based_on && state->applied != 0) facts.based_on = state->applied;
  Result<int> number = AddVersion(text, facts, report);
  if (!number) return number;
  state.value().proposed = *number;
  const Result<void> stored = WriteState(*state);
  if (!stored) return stored.failure();
  return *number;
}

Result<void> ModelStore::Apply(int number, bool confirmed) {
  const Result<files::FileLock> lock = files::FileLock::Take(folder_ + "/lock", lock_wait_);
  if (!lock) return lock.failure();
  bool damaged = false;
  const Result<ModelState> read = ReadState(damaged);
  if (!read && !damaged) return read.failure();
  const Result<std::string> text = Text(number);
  if (!text) return text.failure();
  ModelState state;
  if (read) {
    state = *read;
  } else {
    const Result<int> declared = NewestDeclared();
    if (!declared) return declared.failure();
    state.declared = *declared;
    std::error_code gone;  // ignored: if the file is missing there is nothing to keep
    std::filesystem::rename(StateFile(), StateFile() + ".damaged", gone);
  }
  state.proposed = 0;
  state.set_aside.reset();
  state.confirmed = confirmed;
  if (state.applied != number) {
    state.applied = number;
    state.history.push_back(number);
  }
  ForgetEdit(state);
  return WriteState(state);
}

Result<int> ModelStore::RollBack(bool confirmed) {
  const Result<files::FileLock> lock = files::FileLock::Take(folder_ + "/lock", lock_wait_);
  if (!lock) return lock.failure();
  Result<ModelState> state = State();
  if (!state) return state.failure();
  std::vector<int>& history = state.value().history;
  if (history.size() < 2) return Error{"no version was in force before the present one"};
  history.pop_back();
  state.value().applied = history.back();
  state.value().set_aside.reset();
  state.value().confirmed = confirmed;
  ForgetEdit(state.value());
  const Result<std::string> text = Text(history.back());
  if (!text) return text.failure();
  const Result<void> stored = WriteState(*state);
  if (!stored) return stored.failure();
  return state->applied;
}

Result<void> ModelStore::Withdraw(int refused, int in_force) {
  const Result<files::FileLock> lock = files::FileLock::Take(folder_ + "/lock", lock_wait_);
  if (!lock) return lock.failure();
  const Result<ModelState> read = State();
  if (!read) return read.failure();
  if (read->applied != refused) return {};
  const Result<std::string> text = Text(in_force);
  if (!text) return text.failure();
  ModelState state = *read;
  state.history.pop_back();
  if (state.history.empty() || state.history.back() != in_force) state.history.push_back(in_force);
  state.applied = in_force;
  state.confirmed = false;
  std::optional<SupersededVersion>& aside = state.set_aside;
  const bool was_set_aside = aside && aside->version == in_force;
  if (state.edit && state.declared == refused) {
    state.edit->accepted = was_set_aside ? aside->declared : in_force;
    if (state.proposed == 0) state.proposed = state.edit->withdrawn;
    if (aside) {
      aside->changes = ChangesSince(Text(aside->declared), *text);
      if (aside->withdrawn == state.proposed) aside->withdrawn = 0;
    }
  }
  if (was_set_aside) aside.reset();
  return WriteState(state);
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

}  // namespace plumbline::cell
