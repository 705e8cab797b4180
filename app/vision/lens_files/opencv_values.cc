#include "app/vision/lens_files/opencv_values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "app/base/config/xml_document.h"
#include "app/base/text/yaml_scalars.h"

namespace plumbline::vision {
namespace {

constexpr std::size_t kMostNumbers = 4096;

std::string InLowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

/// Finite numbers separated by white space; nullopt if the text holds anything else.
std::optional<std::vector<double>> NumbersIn(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  std::vector<double> numbers;
  while (true) {
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return numbers;
    text.remove_prefix(first);
    const std::string_view word = text.substr(0, text.find_first_of(kBlanks));
    text.remove_prefix(word.size());
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    const bool whole = error == std::errc() && end == word.data() + word.size();
    if (!whole || !std::isfinite(number) || numbers.size() == kMostNumbers) return std::nullopt;
    numbers.push_back(number);
  }
}

}  // namespace

Result<NamedNumbers> NumbersOfOpenCvXml(std::string_view text) {
  config::FaultList faults;
  const config::XmlDocument document(text, "", faults);
  if (!document.parsed()) {
    const config::Fault& fault = faults.All().front();
    return Error{"line " + std::to_string(fault.line) + ": " + fault.what};
  }
  NamedNumbers values;
  for (const pugi::xml_node& node : document.root().children()) {
    const pugi::xml_node data = node.child("data");
    auto numbers = NumbersIn((data ? data : node).child_value());
    if (numbers) values[InLowerCase(node.name())] = std::move(*numbers);
  }
  return values;
}

Result<NamedNumbers> NumbersOfOpenCvYaml(std::string_view text) {
  // OpenCV writes "%YAML:1.0", which is no directive of YAML: the line is blanked, so that later
  // lines keep their numbers.
  std::string plain(text);
  if (plain.starts_with("%YAML:")) {
    std::fill_n(plain.begin(), std::min(plain.find('\n'), plain.size()), ' ');
  }
  const auto scalars = text::ScalarsFromYaml(plain);
  if (!scalars) return scalars.failure();
  NamedNumbers values;
  for (const text::YamlScalar& scalar : *scalars) {
    const auto number = NumbersIn(scalar.value);
    if (!number || number->size() != 1) continue;
    const std::string& path = scalar.path;
    const std::size_t data = path.find(".data[");
    if (data == std::string::npos && path.find_first_of(".[") != std::string::npos) continue;
    std::vector<double>& of_key = values[InLowerCase(path.substr(0, data))];
    if (of_key.size() < kMostNumbers) of_key.push_back(number->front());
  }
  return values;
}

}  // namespace plumbline::vision
