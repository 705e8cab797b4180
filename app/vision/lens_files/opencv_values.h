// Numbers in a parameter file of cv::FileStorage, by name.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::vision {

/// The numbers of each key of the top level, names in lower case: one number, or the elements of a
/// matrix row by row. Texts and anything else are left out.
using NamedNumbers = std::map<std::string, std::vector<double>>;

/// @return  the numbers, or the reason with its line
Result<NamedNumbers> NumbersOfOpenCvXml(std::string_view text);
/// YAML 1.0 as written by OpenCV, with its header that YAML 1.2 does not know, or plain YAML.
Result<NamedNumbers> NumbersOfOpenCvYaml(std::string_view text);

}  // namespace plumbline::vision
