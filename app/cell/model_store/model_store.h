// Versioned store of the cell's models: declared, proposed and applied ones.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "drivers/files/file_lock.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

/// Metadata of a version.
struct ModelFacts {
  enum class Origin { kDeclared, kDiagnosis, kManual };
  Origin origin = Origin::kManual;
  std::string date;                                   ///< UTC, such as 2026-11-21T07:30:00Z
  std::string from;                                   ///< the file, or the reason for the diagnosis
  std::optional<int> based_on;                        ///< the version that was in force
  std::string verdict;                                ///< of the diagnosis; otherwise empty
  std::vector<std::string> effects;                   ///< ids that the diagnosis added
  std::string report;                                 ///< file name in the store; empty: none
  std::optional<double> rms_before_mm, rms_after_mm;  ///< on held-out rows
  /// Findings that are implausible for a healthy machine, as text.
  std::vector<std::string> implausible;
  /// Share of the correction that named effects do not explain; absent if there is none.
  std::optional<double> discrepancy_share;
  std::optional<double> change_mm;  ///< largest change of a predicted tip, over the rows used
  /// Largest displacement of a configured point's corrected command, at its loads; absent if
  /// unknown.
  std::optional<double> points_change_mm = std::nullopt;
};

struct ModelVersion {
  int number = 0;
  ModelFacts facts;
};

/// An applied version that is no longer in force, because the cell file was edited or the store was
/// found empty.
struct SupersededVersion {
  /// The applied version; 0 if unknown, because the store was empty.
  int version = 0;
  int declared = 0;                  ///< the declared version that it was applied to
  std::vector<std::string> changes;  ///< in the cell file since then, from CellDifferences()
  int withdrawn = 0;                 ///< a proposal that the edit withdrew; 0: none

  bool operator==(const SupersededVersion&) const = default;
};

/// The edit of the cell file that declared the latest version.
struct CellEdit {
  int withdrawn = 0;  ///< a proposal that the edit withdrew; 0: none
  /// The declared version that the version in force belongs to, if Withdraw() refused the edit;
  /// otherwise 0.
  int accepted = 0;

  bool operator==(const CellEdit&) const = default;
};

/// The version in each role, or 0 if there is none.
struct ModelState {
  int declared = 0;          ///< the latest content of the configured cell file
  int applied = 0;           ///< in force
  int proposed = 0;          ///< awaiting a person's approval
  std::vector<int> history;  ///< applied versions, oldest first, ending with the current one
  /// Cleared when any version is applied.
  std::optional<SupersededVersion> set_aside = std::nullopt;
  /// A person put the applied version in force although there are Objections() to it.
  bool confirmed = false;
  /// Cleared when any version is applied; a refused edit only when that edit is applied.
  std::optional<CellEdit> edit = std::nullopt;

  /// The declared version that the version in force belongs to: not `declared` if that was refused.
  int Accepted() const { return edit && edit->accepted != 0 ? edit->accepted : declared; }

  bool operator==(const ModelState&) const = default;
};

/// Command line to be shown to a person: "`plumbline model apply 3 --state DIR`", without --state
/// for the default directory.
std::string ModelCommand(const std::string& words, const std::string& state_directory);

/// A folder `models` in the state directory:
///   0007.toml   the model, never modified
///   0007.json   its facts, likewise; the version exists once this file is written
///   0007.html   its report, if any
///   state.json  declared, proposed and applied version; replaced as a whole
/// Writers lock the file `lock`, waiting up to 10 s; readers need no lock. A power cut at any point
/// leaves the previous state or the new one; files of an incomplete version are overwritten by the
/// next.
///
/// There are two kinds of failure. Open() fails if there is no usable store: the folder cannot be
/// created or listed. State() fails if there is a store but its state cannot be read: callers must
/// not assume another model to be in force then.
class ModelStore {
 public:
  /// Creates the folder if it is missing.
  static Result<ModelStore> Open(const std::string& state_directory);

  /// Sets a callback for writers that have waited 1 s for the lock. Writers give up after 10 s, or
  /// the timeout set by SetLockTimeout().
  void OnLockWait(std::function<void(const std::string& what)> report) {
    lock_wait_.report = std::move(report);
  }

  void SetLockTimeout(double seconds) { lock_wait_.timeout_s = seconds; }

  /// All 0 if the store holds no version yet. Fails if state.json is damaged, unreadable, of a
  /// newer version, or missing although there are versions: it is then unknown which one was in
  /// force, and the error names the command that resolves this. Also fails if state.json is missing
  /// and the folder cannot be listed, because it may hold versions.
  Result<ModelState> State() const;
  /// All complete versions, ascending.
  Result<std::vector<ModelVersion>> Versions() const;
  Result<ModelFacts> Facts(int number) const;
  Result<std::string> Text(int number) const;
  std::string ModelFile(int number) const;
  /// The same for readers that do not open the store.
  static std::string ModelFile(const std::string& state_directory, int number);
  std::string ReportFile(int number) const;

  /// Records the content of the configured cell file. If it describes the same cell as the version
  /// declared before, nothing is written; if the same as the version in force, or as the one
  /// declared before a refused edit, that is the declared one from then on. Otherwise somebody has
  /// edited the cell: the text becomes a new version, which is in force from then on. If a version
  /// other than the declared one was applied, that version is set aside; but a version applied
  /// before any cell file was declared stays in force.
  /// @param expected  kVersions: the state directory was used before. If the store holds no
  ///                  version, that is recorded as `set_aside`, because an applied one may have
  ///                  been lost
  /// @return          the declared version
  enum class Expected { kNothing, kVersions };
  Result<int> Declare(const std::string& text, const std::string& file,
                      Expected expected = Expected::kNothing);

  /// Stores a model as a new version and marks it as proposed.
  /// @param report  path of a report to be stored with it; empty if there is none
  Result<int> Propose(const std::string& text, ModelFacts facts, const std::string& report);

  /// Puts a version in force, and clears `set_aside` and any proposal. If the state cannot be read,
  /// a new one is written: the newest version with a declared origin becomes the declared one, the
  /// history is lost, and the damaged file is renamed to state.json.damaged.
  /// @param confirmed  see ModelState
  Result<void> Apply(int number, bool confirmed = false);

  /// Puts the previous version of the history in force. @return  its number
  Result<int> RollBack(bool confirmed = false);

  /// Undoes that `refused` was applied or declared: `in_force` stays in force, also after a
  /// restart. A refused edit of the cell file remains the declared version, so that the same text
  /// is not declared again; undoing or replacing it does not set `in_force` aside, and the proposal
  /// that it withdrew waits again. Changes nothing if another version has been applied since.
  Result<void> Withdraw(int refused, int in_force);

 private:
  explicit ModelStore(std::string folder) : folder_(std::move(folder)) {}
  std::string StateFile() const { return folder_ + "/state.json"; }
  /// @param damaged  set to true if Apply() may write a new state
  Result<ModelState> ReadState(bool& damaged) const;
  /// @return  number of the newest version of declared origin whose facts can be read, 0 if there
  ///          is none; an error if the folder cannot be listed
  Result<int> NewestDeclared() const;
  /// Writes an empty state if there is none, so that a missing file from now on means a lost one.
  Result<void> InitializeState();
  std::string Path(int number, const char* suffix) const;
  Result<int> AddVersion(const std::string& text, const ModelFacts& facts,
                         const std::string& report);
  Result<void> WriteState(const ModelState& state);
  /// Numbers of all complete versions, ascending. @return  why the folder cannot be listed
  Result<std::vector<int>> Numbers() const;

  std::string folder_;
  files::FileLock::WaitPolicy lock_wait_;
};

const char* NameOf(ModelFacts::Origin origin);

// Text about an applied model that is no longer in force.

/// The first texts, followed by the number of the others.
std::vector<std::string> Abbreviated(std::vector<std::string> texts, std::size_t max_count);

/// Why the applied model is not in force, what that means and what to do, as a paragraph.
/// @param state  must have set_aside
std::string SupersededText(const ModelState& state, const std::string& state_directory);

}  // namespace plumbline::cell
