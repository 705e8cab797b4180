// Fault list of input files: faults and warnings are collected, not thrown, and reported together.
#pragma once

#include <string>
#include <vector>

namespace plumbline::config {

/// A fault or warning, and its position in a file.
struct Fault {
  enum class Severity { kFault, kWarning };
  Severity severity = Severity::kFault;
  std::string file;
  int line = 0;      ///< 1-based; 0 for the file as a whole
  std::string key;   ///< dotted path, list elements counted from 1 (`robot.joint[2].a_mm`)
  std::string what;  ///< starts with the faulty value, if any: `900 is outside 0..300`
  int column = 0;    ///< 1-based, in characters; 0 for the line as a whole
};

/// `cell.toml:41 payload.mass_kg: 900 is outside 0..300`; a warning has `warning: ` before `what`.
std::string FaultText(const Fault& fault);

/// Faults and warnings of any number of files.
class FaultList {
 public:
  void Add(Fault fault) { all_.push_back(std::move(fault)); }

  void Append(const FaultList& other);

  /// Removes the entries of one line.
  void RemoveLine(const std::string& file, int line);

  /// True if at least one entry is a fault; the values read must then not be used.
  bool HasFaults() const;

  const std::vector<Fault>& All() const { return all_; }

  /// Sorts by file, in the order in which the files first appear, and by line.
  void SortByLine();

 private:
  std::vector<Fault> all_;
};

/// One line per entry, each terminated by a newline.
std::string FaultsText(const FaultList& faults);

}  // namespace plumbline::config
