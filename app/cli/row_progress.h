// Progress of a command that works through the rows of a table, for standard error.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>

namespace plumbline {

/// On a terminal one line that is written over; elsewhere nothing for two seconds, then a line each
/// ten per cent. Either names the time left once a twentieth of the rows is done.
class RowProgress {
 public:
  RowProgress(std::ostream& err, bool on_terminal, std::string rows)
      : err_(err), on_terminal_(on_terminal), rows_(std::move(rows)) {}

  /// @param elapsed_s  since the first row
  void Show(std::size_t done, std::size_t of, double elapsed_s);
  /// Takes the line off the terminal.
  void Clear();

 private:
  std::ostream& err_;
  bool on_terminal_;
  std::string rows_;  ///< what a row is: "poses"
  int last_percent_ = -1;
};

}  // namespace plumbline
