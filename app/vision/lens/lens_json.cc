#include "app/vision/lens/lens_json.h"

#include <fmt/format.h>

#include "app/base/text/json_text.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::vision {
namespace {

using Json = nlohmann::ordered_json;

Json UncertaintyJson(const ProjectionUncertainty& uncertainty) {
  Json grid = Json::array();
  for (int row = 0; row < uncertainty.rows; ++row) {
    Json line = Json::array();
    for (int column = 0; column < uncertainty.columns; ++column)
      line.push_back(text::NumberJson(uncertainty.sd_px[row * uncertainty.columns + column]));
    grid.push_back(std::move(line));
  }
  Json basis = "infinity";
  if (uncertainty.distance_m) basis = {{"distance_mm", *uncertainty.distance_m * kMmPerMetre}};
  return {{"basis", basis}, {"max", text::NumberJson(uncertainty.max_px)}, {"grid", grid}};
}

/// The usable region; null: the whole image.
Json RegionJson(const LensCalibration& c) {
  if (lens::UsableEverywhere(c)) return nullptr;
  const lens::Vec2 middle = lens::MiddleOf(c.size);
  return {{"centre", {middle.x(), middle.y()}},
          {"radius_px", c.usable_radius_px},
          {"share", lens::UsableShare(c)},
          {"max_beyond_px", text::NumberJson(c.everywhere_px)}};
}

Json BoardJson(const target::Board& board) {
  Json json = {{"kind", NameOf(board.kind)},
               {"columns", board.columns},
               {"rows", board.rows},
               {"square_mm", board.square_m * kMmPerMetre}};
  if (board.kind != target::BoardKind::kChessboard) json["mark_mm"] = board.marker_m * kMmPerMetre;
  if (board.kind == target::BoardKind::kCharuco) json["family"] = board.family;
  return json;
}

/// Names of the facts that were declared.
Json DeclaredJson(const target::DeclaredFacts& declared) {
  Json names = Json::array();
  if (declared.no_window) names.push_back("no_window");
  if (declared.fixed_focus) names.push_back("fixed_focus");
  if (declared.oblong_pixels) names.push_back("oblong_pixels");
  return names;
}

/// Reads numbers from an object; `fault` names the first one that is missing or not a number.
class Numbers {
 public:
  explicit Numbers(const nlohmann::json& object) : object_(object) {}

  double Of(const char* key) {
    const auto found = object_.find(key);
    if (found == object_.end() || !found->is_number()) {
      if (fault.empty()) fault = fmt::format("\"{}\" is missing or not a number", key);
      return 0;
    }
    return found->get<double>();
  }

  std::string fault;

 private:
  const nlohmann::json& object_;
};

/// Number of lens parameters in a file.
int ParametersOf(const lens::Lens& lens) {
  return lens::ModelOf(lens) == lens::LensModel::kUsual ? lens::kUsualParameters
                                                        : lens::kLensParameters;
}

/// @param count  number of parameters
bool FillCovariance(const nlohmann::json& root, int count, lens::LensCovariance& covariance) {
  const auto given = root.find("covariance");
  if (given == root.end()) return true;  // optional: other programs' files may not have it
  const auto matrix = given->is_object() ? given->find("matrix") : given->end();
  if (!given->is_object() || matrix == given->end() || !matrix->is_array() ||
      matrix->size() != static_cast<std::size_t>(count))
    return false;
  for (int i = 0; i < count; ++i) {
    const nlohmann::json& row = (*matrix)[i];
    if (!row.is_array() || row.size() != static_cast<std::size_t>(count)) return false;
    for (int j = 0; j < count; ++j) {
      if (!row[j].is_number()) return false;
      covariance(i, j) = row[j].get<double>();
    }
  }
  return covariance.allFinite() && (covariance.diagonal().array() >= 0).all() &&
         covariance.isApprox(covariance.transpose(), 1e-6);
}

bool FillDistortion(const nlohmann::json& root, lens::Lens& lens) {
  const auto given = root.find("distortion");
  if (given == root.end() || !given->is_array()) return false;
  std::vector<double> values;
  for (const nlohmann::json& value : *given) {
    if (!value.is_number()) return false;
    values.push_back(value.get<double>());
  }
  return lens::SetDistortion(values, root.value("model", nlohmann::json()) == "fisheye", lens);
}

/// Reads the usable region, which is optional.
bool FillRegion(const nlohmann::json& root, lens::KnownLens& lens) {
  const auto region = root.find("usable_region");
  if (region == root.end() || region->is_null()) return true;
  const auto radius = region->is_object() ? region->find("radius_px") : region->end();
  if (!region->is_object() || radius == region->end() || !radius->is_number()) return false;
  lens.usable_radius_px = radius->get<double>();
  return lens.usable_radius_px > 0;
}

}  // namespace

std::string LensJson(const LensCalibration& c) {
  const bool any = c.lens.fx > 0;
  const auto value = [any](double number) {
    return any ? text::NumberJson(number) : Json(nullptr);
  };
  Json order = Json::array(), matrix = Json::array(), refused = Json::array();
  const int count = ParametersOf(c.lens);
  for (int i = 0; i < count; ++i) {
    order.push_back(lens::kLensParameterNames[i]);
    Json row = Json::array();
    for (int j = 0; j < count; ++j) row.push_back(value(c.covariance(i, j)));
    matrix.push_back(std::move(row));
  }
  for (const RefusedFrame& frame : c.frames_refused)
    refused.push_back({{"name", frame.name}, {"reason", frame.reason}});
  Json distortion = Json::array();
  for (const double coefficient : lens::DistortionOf(c.lens))
    distortion.push_back(value(coefficient));
  const Json root = {
      {"schema", 1},
      {"accepted", c.accepted},
      {"reasons", c.reasons},
      {"notes", c.notes},
      {"usable_region", RegionJson(c)},
      {"image_size", {c.size.width, c.size.height}},
      {"fx", value(c.lens.fx)},
      {"fy", value(c.lens.fy)},
      {"cx", value(c.lens.cx)},
      {"cy", value(c.lens.cy)},
      {"model", lens::ModelName(lens::ModelOf(c.lens))},
      {"distortion", distortion},
      {"covariance", {{"order", order}, {"matrix", matrix}}},
      {"rms_px", value(c.rms_px)},
      {"board_bow_mm", value(c.board_bow_m * kMmPerMetre)},
      {"projection_uncertainty_px", any ? UncertaintyJson(c.uncertainty) : Json(nullptr)},
      {"coverage", c.coverage},
      {"board", BoardJson(c.board)},
      {"declared", DeclaredJson(c.declared)},
      {"frames_used", c.frames_used},
      {"frames_refused", refused},
  };
  return text::JsonText(root, 2) + "\n";
}

Result<LensFile> LensFromJson(std::string_view text) {
  const auto json = text::JsonFromText(text);
  if (!json || !json->is_object()) {
    return Error{fmt::format("{}; a lens file is written by plumbline calibrate-lens",
                             json ? "not a JSON object" : json.error())};
  }
  const nlohmann::json& root = *json;
  LensFile file;
  file.accepted = root.value("accepted", nlohmann::json(false)) == nlohmann::json(true);
  const auto size = root.find("image_size");
  if (size == root.end() || !size->is_array() || size->size() != 2 ||
      !(*size)[0].is_number_integer() || !(*size)[1].is_number_integer() ||
      (*size)[0].get<long>() < 1 || (*size)[1].get<long>() < 1 || (*size)[0].get<long>() > 65536 ||
      (*size)[1].get<long>() > 65536)
    return Error{"\"image_size\" is not [width, height] in pixels"};
  file.size = {(*size)[0].get<int>(), (*size)[1].get<int>()};
  Numbers numbers(root);
  file.lens.fx = numbers.Of("fx");
  file.lens.fy = numbers.Of("fy");
  file.lens.cx = numbers.Of("cx");
  file.lens.cy = numbers.Of("cy");
  if (!numbers.fault.empty()) return Error{numbers.fault};
  if (!(file.lens.fx > 0) || !(file.lens.fy > 0))
    return Error{"\"fx\" and \"fy\" are not positive"};
  if (!FillDistortion(root, file.lens)) {
    return Error{
        "\"distortion\" is not [k1, k2, p1, p2, k3], optionally with k4, k5, k6 and then "
        "s1, s2, s3, s4; or, with \"model\": \"fisheye\", [k1, k2, k3, k4]"};
  }
  if (!FillRegion(root, file))
    return Error{"\"usable_region\".\"radius_px\" is not a positive number"};
  const int count = ParametersOf(file.lens);
  if (!FillCovariance(root, count, file.covariance)) {
    return Error{fmt::format(
        "\"covariance\".\"matrix\" is not a symmetric matrix of {} x {} numbers", count, count)};
  }
  return file;
}

}  // namespace plumbline::vision
