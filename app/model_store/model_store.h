// Every version of the cell's model that was ever declared, proposed or in force.
#pragma once

#include <optional>
#include <string>
#include <vector>

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
  std::vector<std::string> implausible;   ///< what a sound machine does not show, in words
  std::optional<double> remainder_share;  ///< of the correction that has no name; absent: none
  std::optional<double> change_mm;        ///< largest change of a predicted tip on the rows used
};

struct ModelVersion {
  int number = 0;
  ModelFacts facts;
};

/// Which versions are what. 0: none.
struct ModelState {
  int declared = 0;          ///< the newest content of the cell file that the configuration names
  int applied = 0;           ///< in force
  int proposed = 0;          ///< waiting for a person
  std::vector<int> history;  ///< applied before, oldest first; the last one is the present

  bool operator==(const ModelState&) const = default;
};

/// "`plumbline model apply 3 --state DIR`", as a person pastes it; without --state for the usual
/// one.
std::string ModelCommand(const std::string& words, const std::string& state_directory);

/// A folder `models` in the state directory:
///   0007.toml   the model, never written again
///   0007.json   its facts, likewise; the version exists once this file stands
///   0007.html   its report, if any
///   state.json  which version is declared, proposed, applied; replaced as a whole
/// Writers hold the lock file `lock`; readers need none. A cut at any point leaves the former state
/// or the new one; files of a version that was not completed are overwritten by the next.
class ModelStore {
 public:
  /// Makes the folder where there is none.
  static Result<ModelStore> Open(const std::string& state_directory);

  Result<ModelState> State() const;
  /// All complete versions, ascending.
  Result<std::vector<ModelVersion>> Versions() const;
  Result<ModelFacts> Facts(int number) const;
  Result<std::string> Text(int number) const;
  std::string ModelFile(int number) const;
  std::string ReportFile(int number) const;

  /// Notes the content of the configured cell file. New content becomes a version of its own and
  /// is in force from then on: somebody edited the cell. @return the version declared
  Result<int> Declare(const std::string& text, const std::string& file);

  /// Keeps a model as a new version and marks it as proposed.
  /// @param report  path of a report to keep beside it; empty: none
  Result<int> Propose(const std::string& text, ModelFacts facts, const std::string& report);

  /// Puts a version in force. A proposal is withdrawn when it, or anything else, is applied.
  Result<bool> Apply(int number);

  /// Puts the version in force that was so before the present one. @return its number
  Result<int> RollBack();

 private:
  explicit ModelStore(std::string folder) : folder_(std::move(folder)) {}
  std::string Path(int number, const char* suffix) const;
  Result<int> AddVersion(const std::string& text, const ModelFacts& facts,
                         const std::string& report);
  Result<bool> WriteState(const ModelState& state);
  std::vector<int> Numbers() const;

  std::string folder_;
};

const char* NameOf(ModelFacts::Origin origin);

/// The present time as facts tell it.
std::string UtcNow();

}  // namespace plumbline
