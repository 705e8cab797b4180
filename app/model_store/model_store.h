// Every version of the cell's model that was ever declared, proposed or in force.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/model_store/durable_file.h"
#include "firmware-like/result.h"

namespace plumbline {

/// What is known of a version beside its cell.toml.
struct ModelFacts {
  enum class Origin { kDeclared, kDiagnosis, kManual };
  Origin origin = Origin::kManual;
  std::string date;                                   ///< UTC, as 2026-11-21T07:30:00Z
  std::string from;                                   ///< the file, or the reason for the diagnosis
  std::optional<int> based_on;                        ///< the version that was in force
  std::string verdict;                                ///< of the diagnosis; else empty
  std::vector<std::string> effects;                   ///< ids that the diagnosis added
  std::string report;                                 ///< file name in the store; empty: none
  std::optional<double> rms_before_mm, rms_after_mm;  ///< on held-out rows
  std::vector<std::string> implausible;     ///< what a sound machine does not show, in words
  std::optional<double> discrepancy_share;  ///< of the correction that has no name; absent: none
  std::optional<double> change_mm;          ///< largest change of a predicted tip on the rows used
  /// Largest move of a configured point's corrected command at its loads; absent: not known.
  std::optional<double> points_change_mm = std::nullopt;
};

struct ModelVersion {
  int number = 0;
  ModelFacts facts;
};

/// An applied version that is out of force: by an edit of the cell file, or because the store that
/// held it was found empty.
struct SetAside {
  /// Applied by a person or the daemon; 0: not known, the store was empty.
  int version = 0;
  int declared = 0;                  ///< the declared version beside which it was in force
  std::vector<std::string> changes;  ///< of the cell file since, as CellDifferences() has them
  int withdrawn = 0;                 ///< a proposal that the edit withdrew; 0: none waited

  bool operator==(const SetAside&) const = default;
};

/// Which versions are what. 0: none.
struct ModelState {
  int declared = 0;          ///< the newest content of the cell file that the configuration names
  int applied = 0;           ///< in force
  int proposed = 0;          ///< waiting for a person
  std::vector<int> history;  ///< applied before, oldest first; the last one is the present
  /// Until a version is applied, this one or another.
  std::optional<SetAside> set_aside = std::nullopt;

  bool operator==(const ModelState&) const = default;
};

/// "`plumbline model apply 3 --state DIR`", as a person pastes it; without --state for the usual
/// one.
std::string ModelCommand(const std::string& words, const std::string& state_directory);

/// Why the model that was applied is not in force, what that means and what to do, in a paragraph.
/// @param state  with set_aside
std::string SetAsideText(const ModelState& state, const std::string& state_directory);

/// A folder `models` in the state directory:
///   0007.toml   the model, never written again
///   0007.json   its facts, likewise; the version exists once this file stands
///   0007.html   its report, if any
///   state.json  which version is declared, proposed, applied; replaced as a whole
/// Writers hold the lock file `lock`, and wait 10 s for it; readers need none. A cut at any point
/// leaves the previous state or the new one; files of a version that was not completed are
/// overwritten by the next.
///
/// Two kinds of failure are kept apart. Open() fails where there is no store to be had: the folder
/// cannot be made, or cannot be looked into. State() fails where there is a store and its state
/// cannot be read: nobody may then take another model for the one in force, see State().
class ModelStore {
 public:
  /// Makes the folder where there is none.
  static Result<ModelStore> Open(const std::string& state_directory);

  /// Writers give up after 10 s, or SetLockTimeout(), where another process holds the lock. `report` is
  /// called once a writer has waited for 1 s.
  void ReportWaits(std::function<void(const std::string& what)> report) {
    patience_.report = std::move(report);
  }

  void SetLockTimeout(double seconds) { patience_.longest_s = seconds; }

  /// All 0 where the store holds no version yet. An error where state.json is damaged, cannot be
  /// read, is of a newer version, or is missing although there are versions: which one was in force
  /// is then not known, and the error names the command that decides it. An error, too, where
  /// state.json is missing and the folder cannot be listed: it may hold versions.
  Result<ModelState> State() const;
  /// All complete versions, ascending.
  Result<std::vector<ModelVersion>> Versions() const;
  Result<ModelFacts> Facts(int number) const;
  Result<std::string> Text(int number) const;
  std::string ModelFile(int number) const;
  std::string ReportFile(int number) const;

  /// Notes the content of the configured cell file. A text that means the same cell as the version
  /// declared before changes nothing, and nothing is written. Another cell becomes a version of its
  /// own and is in force from then on: somebody edited the cell. Where another version than the
  /// declared one was applied, it is set aside; one that was applied before any cell file was
  /// declared stays in force. @return the version declared
  /// @param expected  kVersions: the state directory was used before. Where the store holds no
  ///                  version, that is noted as `set_aside`, as an applied one may have been lost
  enum class Expected { kNothing, kVersions };
  Result<int> Declare(const std::string& text, const std::string& file,
                      Expected expected = Expected::kNothing);

  /// Keeps a model as a new version and marks it as proposed.
  /// @param report  path of a report to keep beside it; empty: none
  Result<int> Propose(const std::string& text, ModelFacts facts, const std::string& report);

  /// Puts a version in force; one that was set aside no longer waits for a decision. A proposal is
  /// withdrawn when it, or anything else, is applied. A state that cannot be read is written anew:
  /// the newest version that was declared counts as the declared one, the history is lost, and the
  /// damaged file is kept as state.json.damaged.
  Result<void> Apply(int number);

  /// Puts the version in force that was so before the present one. @return its number
  Result<int> RollBack();

 private:
  explicit ModelStore(std::string folder) : folder_(std::move(folder)) {}
  std::string StateFile() const { return folder_ + "/state.json"; }
  /// @param damaged  set where a person may have the state written anew
  Result<ModelState> ReadState(bool& damaged) const;
  /// The version last declared, as far as the versions' facts can be read; 0: none.
  /// @return why the folder cannot be listed
  Result<int> NewestDeclared() const;
  /// Where there is no state yet, writes an empty one: from now on a missing file is a lost one.
  Result<void> BeginState();
  std::string Path(int number, const char* suffix) const;
  Result<int> AddVersion(const std::string& text, const ModelFacts& facts,
                         const std::string& report);
  Result<void> WriteState(const ModelState& state);
  /// Of all complete versions, ascending. @return why the folder cannot be listed
  Result<std::vector<int>> Numbers() const;

  std::string folder_;
  FileLock::Patience patience_;
};

const char* NameOf(ModelFacts::Origin origin);

/// The present time as facts tell it.
std::string UtcNow();

}  // namespace plumbline
