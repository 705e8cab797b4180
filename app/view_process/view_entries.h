// Log entries of the viewer that have no event of their own; repeats are counted per text.
#pragma once

#include <string>

#include "app/log/log_entry.h"

namespace plumbline {

inline LogEntry ViewFault(const std::string& text) {
  return {Event::kViewFault, text, {{"ABOUT", text}}};
}

inline LogEntry ViewNote(const std::string& text) {
  return {Event::kViewNote, text, {{"ABOUT", text}}};
}

}  // namespace plumbline
