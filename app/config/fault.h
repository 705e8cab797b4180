// Faults of configuration files and tables: collected, never thrown, told all at once.
#pragma once

#include <string>
#include <vector>

namespace plumbline {

/// What is wrong at one place of a file.
struct Fault {
  enum class Severity { kFault, kWarning };
  Severity severity = Severity::kFault;
  std::string file;
  int line = 0;      ///< 1-based; 0: the file as a whole
  std::string key;   ///< dotted path, list elements counted from 1 (`robot.joint[2].a_mm`)
  std::string what;  ///< begins with the value where there is one: `900 is outside 0..300`
};

/// `cell.toml:41 payload.mass_kg: 900 is outside 0..300`; a warning has `warning: ` before `what`.
std::string FaultText(const Fault& fault);

/// All that was found wrong, of any number of files.
class FaultList {
 public:
  void Add(Fault fault) { all_.push_back(std::move(fault)); }

  void Append(const FaultList& other);

  /// True where at least one entry is a fault, so that what was read must not be used.
  bool HasFaults() const;

  const std::vector<Fault>& All() const { return all_; }

  /// Orders the entries by file (in the order in which files first appear) and line.
  void SortByLine();

 private:
  std::vector<Fault> all_;
};

/// One line an entry, each ended by a newline.
std::string FaultsText(const FaultList& faults);

}  // namespace plumbline
