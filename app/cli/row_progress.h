// Progress display of a command that processes the rows of a table, for standard error.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>

namespace plumbline::cli {

/// On a terminal, a single updated line; elsewhere, after two seconds, a line every ten per cent.
/// Both show the remaining time once 5 % of the rows are done.
class RowProgress {
 public:
  RowProgress(std::ostream& err, bool on_terminal, std::string rows)
      : err_(err), on_terminal_(on_terminal), rows_(std::move(rows)) {}

  /// @param elapsed_s  since the first row
  void Show(std::size_t done, std::size_t of, double elapsed_s);
  /// Erases the line on the terminal.
  void Clear();

 private:
  std::ostream& err_;
  bool on_terminal_;
  std::string rows_;  ///< plural name of the rows: "poses"
  int last_percent_ = -1;
};

}  // namespace plumbline::cli
