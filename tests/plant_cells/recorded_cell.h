// Recorded cell: what a simulated cell of the demo reports, from files.
#pragma once

#include <string>
#include <vector>

#include "tests/plant_cells/cell_client.h"

namespace plumbline::plant_cells {

/// A folder with `messages.jsonl`: one line a message, {"at_s": of the recording, "type": "NPROBE",
/// "body": {...}}, in the order of at_s.
class RecordedCell {
 public:
  /// Exits with a message if the folder cannot be read.
  explicit RecordedCell(const std::string& folder);
  /// utc_ms of an item is its time in the recording.
  const std::vector<Item>& items() const { return items_; }
  const std::string& Body(const Item& item) const {
    return bodies_[static_cast<std::size_t>(item.index)];
  }

 private:
  std::vector<Item> items_;
  std::vector<std::string> bodies_;
};

}  // namespace plumbline::plant_cells
