#include "app/base/text/yaml_scalars.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <stdexcept>

namespace plumbline::text {
namespace {

/// Too many or too deeply nested scalars.
struct TooLarge : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class ScalarCollector {
 public:
  void Add(const YAML::Node& node, const std::string& path, int depth) {
    if (depth > kMaxYamlDepth || scalars_.size() >= kMaxYamlScalars || ++nodes_ > kMaxNodes) {
      throw TooLarge(
          fmt::format("line {}: is nested more than {} deep or holds more than {} values",
                      node.Mark().line + 1, kMaxYamlDepth, kMaxYamlScalars));
    }
    bytes_ += path.size() + (node.IsScalar() ? node.Scalar().size() : 0);
    if (bytes_ > kMaxYamlBytes) {
      throw TooLarge(fmt::format(
          "line {}: the values and their names have more than {} MiB, aliases expanded; shorten "
          "them",
          node.Mark().line + 1, kMaxYamlBytes >> 20U));
    }
    if (node.IsScalar()) scalars_.push_back({path, node.Scalar(), node.Mark().line + 1});
    if (node.IsSequence()) {
      std::size_t count = 0;
      for (const YAML::Node& child : node)
        Add(child, fmt::format("{}[{}]", path, ++count), depth + 1);
    }
    if (!node.IsMap()) return;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) continue;
      const std::string& key = entry.first.Scalar();
      Add(entry.second, path.empty() ? key : path + "." + key, depth + 1);
    }
  }
  std::vector<YamlScalar> Take() { return std::move(scalars_); }

 private:
  static constexpr std::size_t kMaxNodes = 2 * kMaxYamlScalars;
  std::vector<YamlScalar> scalars_;
  std::size_t nodes_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace

Result<std::vector<YamlScalar>> ScalarsFromYaml(std::string_view text) {
  try {
    ScalarCollector collector;
    collector.Add(YAML::Load(std::string(text)), "", 0);
    return collector.Take();
  } catch (const TooLarge& error) {
    return Error{error.what()};
  } catch (const YAML::Exception& error) {
    const std::string where =
        error.mark.is_null() ? std::string() : fmt::format("line {}: ", error.mark.line + 1);
    return Error{fmt::format("{}is not valid YAML: {}; correct it there", where, error.msg)};
  }
}

}  // namespace plumbline::text
