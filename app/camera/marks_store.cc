#include "app/camera/marks_store.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/config/text_file.h"
#include "app/model_store/durable_file.h"
#include "app/text/json_text.h"

namespace plumbline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kMarksSchema = 1;
constexpr double kSlack = 1e-6;

template <typename Matrix>
Json NumbersOf(const Matrix& matrix) {
  Json array = Json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) array.push_back(matrix(r, c));
  }
  return array;
}

/// Throws as the library does, what is missing or wrong in words; only below MarksFromJson().
template <typename Matrix>
void Read(const Json& array, Matrix& matrix) {
  if (array.size() != static_cast<std::size_t>(matrix.size())) throw std::runtime_error("a length");
  std::size_t at = 0;
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) matrix(r, c) = array.at(at++).get<double>();
  }
}

/// The declared marks, to tell whether they are still the same.
Json Declared(const Body& cell) {
  Json marks = Json::array();
  for (const BodyTag& tag : cell.tags) {
    marks.push_back({tag.id, tag.side_m, NumbersOf(tag.X_KM.R), NumbersOf(tag.X_KM.p)});
  }
  return marks;
}

MarksMemory MemoryFrom(const Json& json) {
  MarksMemory memory;
  Read(json.at("R"), memory.X_CK.R);
  Read(json.at("p_m"), memory.X_CK.p);
  for (const auto& [id, tag] : json.at("tags").items()) {
    MarksMemory::Tag& read = memory.tags[std::stoi(id)];
    Eigen::Matrix<double, 4, 2> residual;
    Read(tag.at("residual_px"), residual);
    for (std::size_t k = 0; k < 4; ++k) {
      read.residual_px[k] = residual.row(static_cast<Eigen::Index>(k)).transpose();
    }
    Read(tag.at("covariance_px2"), read.covariance);
    if (!read.covariance.isApprox(read.covariance.transpose(), kSlack) ||
        read.covariance.diagonal().minCoeff() < 0) {
      throw std::runtime_error("a covariance");
    }
  }
  if (!memory.X_CK.R.isUnitary(kSlack) || memory.X_CK.R.determinant() < 0) {
    throw std::runtime_error("a rotation");
  }
  return memory;
}

}  // namespace

std::string MarksJson(const std::map<std::int64_t, MarksMemory>& memories, const Body& cell) {
  Json lenses = Json::object();
  for (const auto& [id, memory] : memories) {
    Json tags = Json::object();
    for (const auto& [tag_id, tag] : memory.tags) {
      Eigen::Matrix<double, 4, 2> residual;
      for (std::size_t k = 0; k < 4; ++k) {
        residual.row(static_cast<Eigen::Index>(k)) = tag.residual_px[k].transpose();
      }
      tags[std::to_string(tag_id)] = {{"residual_px", NumbersOf(residual)},
                                      {"covariance_px2", NumbersOf(tag.covariance)}};
    }
    lenses[std::to_string(id)] = {
        {"R", NumbersOf(memory.X_CK.R)}, {"p_m", NumbersOf(memory.X_CK.p)}, {"tags", tags}};
  }
  return Json{{"schema", kMarksSchema}, {"marks", Declared(cell)}, {"lenses", lenses}}.dump() +
         "\n";
}

Result<std::map<std::int64_t, MarksMemory>> MarksFromJson(const std::string& text,
                                                          const Body& cell) {
  std::map<std::int64_t, MarksMemory> memories;
  try {
    const Result<Json> read = JsonFromText(text);
    if (!read) return read.failure();
    const Json& json = *read;
    if (json.at("schema") != kMarksSchema) {
      return Error{fmt::format("its schema is not {}", kMarksSchema)};
    }
    if (json.at("marks") != JsonOrNull(Declared(cell).dump())) return memories;
    for (const auto& [id, memory] : json.at("lenses").items()) {
      memories[std::stoll(id)] = MemoryFrom(memory);
    }
  } catch (const std::exception& error) {
    return Error{error.what()};
  }
  return memories;
}

MarksStore::MarksStore(std::string path, Body cell, std::string& problem)
    : path_(std::move(path)), cell_(std::move(cell)) {
  std::error_code none;
  if (!fs::exists(path_, none)) return;
  const Result<std::string> text = ReadTextFile(path_);
  auto read = text ? MarksFromJson(*text, cell_) : Error{text.error()};
  if (read) {
    memories_ = std::move(read).value();
    return;
  }
  unread_ = true;
  problem = fmt::format("{}: {}; the marks are looked at anew, the file is kept beside as .unread",
                        path_, read.error());
}

std::shared_ptr<const MarksMemory> MarksStore::Find(std::int64_t lens_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = memories_.find(lens_id);
  return found == memories_.end() ? nullptr : std::make_shared<MarksMemory>(found->second);
}

Result<void> MarksStore::Keep(std::int64_t lens_id, const MarksMemory& memory) {
  const std::lock_guard lock(mutex_);
  memories_[lens_id] = memory;
  std::error_code not_moved;  // then it is told as what cannot be written
  if (std::exchange(unread_, false)) fs::rename(path_, path_ + ".unread", not_moved);
  return WriteDurably(path_, MarksJson(memories_, cell_));
}

}  // namespace plumbline
