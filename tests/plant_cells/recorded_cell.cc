#include "tests/plant_cells/recorded_cell.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

namespace plumbline::plant_cells {
namespace {

/// The word as it lives in this program: an item holds a pointer.
const char* TypeNamed(const std::string& name) {
  static constexpr std::array kTypes = {"NDATA", "NPROBE", "NALARM", "NMODEL",
                                        "NLENS", "NPOINT", "NCELL",  "NLOST"};
  for (const char* type : kTypes) {
    if (name == type) return type;
  }
  std::cerr << "unknown type of a message: " << name << '\n';
  std::exit(1);
}

}  // namespace

RecordedCell::RecordedCell(const std::string& folder) {
  std::ifstream file(folder + "/messages.jsonl");
  if (!file) {
    std::cerr << folder << "/messages.jsonl cannot be read\n";
    std::exit(1);
  }
  for (std::string line; std::getline(file, line);) {
    const auto json = nlohmann::json::parse(line);
    items_.push_back({std::llround(1e3 * json.at("at_s").get<double>()),
                      TypeNamed(json.at("type").get<std::string>()),
                      static_cast<std::int32_t>(bodies_.size())});
    bodies_.push_back(json.at("body").dump());
  }
}

}  // namespace plumbline::plant_cells
