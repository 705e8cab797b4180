#include "app/vision/camera/tag_baseline_store.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "app/base/text/json_text.h"
#include "drivers/files/replace_file.h"
#include "drivers/files/text_file.h"

namespace plumbline::vision {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kSchema = 1;
constexpr double kTolerance = 1e-6;

template <typename Matrix>
Json NumbersOf(const Matrix& matrix) {
  Json array = Json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) array.push_back(matrix(r, c));
  }
  return array;
}

/// Throws on malformed input, as the JSON library does; TagBaselinesFromJson() catches both.
template <typename Matrix>
void Read(const Json& array, Matrix& matrix) {
  if (array.size() != static_cast<std::size_t>(matrix.size())) {
    throw std::runtime_error("an array has the wrong length");
  }
  std::size_t at = 0;
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) matrix(r, c) = array.at(at++).get<double>();
  }
}

/// The tags' declaration, stored to detect that it has changed.
Json Declared(const target::Body& cell) {
  Json tags = Json::array();
  for (const target::BodyTag& tag : cell.tags) {
    Json declared = {tag.id, tag.side_m, NumbersOf(tag.X_KM.R), NumbersOf(tag.X_KM.p)};
    if (tag.drawn_by != target::DrawnBy::kUnspecified) {
      declared.push_back(static_cast<int>(tag.drawn_by));
    }
    tags.push_back(std::move(declared));
  }
  return tags;
}

TagBaseline BaselineFrom(const Json& json) {
  TagBaseline baseline;
  Read(json.at("R"), baseline.X_CK.R);
  Read(json.at("p_m"), baseline.X_CK.p);
  for (const auto& [id, tag] : json.at("tags").items()) {
    TagBaseline::Tag& read = baseline.tags[std::stoi(id)];
    Eigen::Matrix<double, 4, 2> residual;
    Read(tag.at("residual_px"), residual);
    for (std::size_t k = 0; k < 4; ++k) {
      read.residual_px[k] = residual.row(static_cast<Eigen::Index>(k)).transpose();
    }
    Read(tag.at("covariance_px2"), read.covariance);
    if (!read.covariance.isApprox(read.covariance.transpose(), kTolerance) ||
        read.covariance.diagonal().minCoeff() < 0) {
      throw std::runtime_error("a covariance is not valid");
    }
  }
  if (!baseline.X_CK.R.isUnitary(kTolerance) || baseline.X_CK.R.determinant() < 0) {
    throw std::runtime_error("a rotation is not valid");
  }
  return baseline;
}

}  // namespace

std::string TagBaselinesJson(const TagBaselines& baselines, const target::Body& cell) {
  Json lenses = Json::object();
  for (const auto& [id, baseline] : baselines.by_lens) {
    Json tags = Json::object();
    for (const auto& [tag_id, tag] : baseline.tags) {
      Eigen::Matrix<double, 4, 2> residual;
      for (std::size_t k = 0; k < 4; ++k) {
        residual.row(static_cast<Eigen::Index>(k)) = tag.residual_px[k].transpose();
      }
      tags[std::to_string(tag_id)] = {{"residual_px", NumbersOf(residual)},
                                      {"covariance_px2", NumbersOf(tag.covariance)}};
    }
    lenses[std::to_string(id)] = {
        {"R", NumbersOf(baseline.X_CK.R)}, {"p_m", NumbersOf(baseline.X_CK.p)}, {"tags", tags}};
  }
  Json json = {{"schema", kSchema}, {"marks", Declared(cell)}, {"lenses", lenses}};
  if (!baselines.contradicted.empty()) json["contradicted"] = baselines.contradicted;
  return text::JsonText(json) + "\n";
}

Result<TagBaselines> TagBaselinesFromJson(const std::string& text, const target::Body& cell) {
  TagBaselines baselines;
  try {
    const Result<Json> read = text::JsonFromText(text);
    if (!read) return read.failure();
    const Json& json = *read;
    if (json.at("schema") != kSchema) {
      return Error{fmt::format("its schema is not {}", kSchema)};
    }
    if (json.at("marks") != text::JsonOrNull(text::JsonText(Declared(cell)))) return baselines;
    for (const auto& [id, baseline] : json.at("lenses").items()) {
      baselines.by_lens[std::stoll(id)] = BaselineFrom(baseline);
    }
    if (const auto ids = json.find("contradicted"); ids != json.end()) {
      baselines.contradicted = ids->get<std::set<std::int64_t>>();
    }
  } catch (const std::exception& error) {
    return Error{error.what()};
  }
  return baselines;
}

TagBaselineStore::TagBaselineStore(std::string path, target::Body cell, std::string& problem)
    : path_(std::move(path)), cell_(std::move(cell)) {
  std::error_code none;
  if (!fs::exists(path_, none)) return;
  const Result<std::string> text = files::ReadTextFile(path_);
  auto read = text ? TagBaselinesFromJson(*text, cell_) : Error{text.error()};
  if (read) {
    baselines_ = std::move(read).value();
    return;
  }
  unreadable_ = true;
  problem = fmt::format(
      "{}: {}; the reference tags are verified again without their history, and the file will "
      "be preserved as .unread",
      path_, read.error());
}

std::shared_ptr<const TagBaseline> TagBaselineStore::Find(std::int64_t lens_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = baselines_.by_lens.find(lens_id);
  return found == baselines_.by_lens.end() ? nullptr : std::make_shared<TagBaseline>(found->second);
}

Result<void> TagBaselineStore::Store(std::int64_t lens_id, const TagBaseline& baseline) {
  const std::lock_guard lock(mutex_);
  baselines_.by_lens[lens_id] = baseline;
  baselines_.contradicted.erase(lens_id);
  return Write();
}

Result<void> TagBaselineStore::StoreContradiction(std::int64_t lens_id) {
  const std::lock_guard lock(mutex_);
  baselines_.contradicted.insert(lens_id);
  return Write();
}

bool TagBaselineStore::IsContradicted(std::int64_t lens_id) const {
  const std::lock_guard lock(mutex_);
  return baselines_.contradicted.count(lens_id) > 0;
}

Result<void> TagBaselineStore::Write() {
  std::error_code not_moved;  // the write below then fails and is reported
  if (std::exchange(unreadable_, false)) fs::rename(path_, path_ + ".unread", not_moved);
  return files::ReplaceFileDurably(path_, TagBaselinesJson(baselines_, cell_));
}

}  // namespace plumbline::vision
