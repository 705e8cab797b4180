#include "app/cell/model_store/superseded_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

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

}  // namespace plumbline::cell
