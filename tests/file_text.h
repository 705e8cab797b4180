// A whole file as text.
#pragma once

#include <fstream>
#include <sstream>
#include <string>

namespace plumbline::test {

/// Empty where the file cannot be read.
inline std::string FileText(const std::string& path) {
  const std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace plumbline::test
