// A parsed XML text whose elements know their line.
#pragma once

#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/base/config/fault.h"

namespace plumbline::config {

/// The tree of a text. The parser is not recursive and knows no entities but the five of XML
/// itself.
class XmlDocument {
 public:
  /// @param text    must outlive the object
  /// @param faults  receives a syntax error, or the refusal of a document type declaration
  XmlDocument(std::string_view text, const std::string& file, config::FaultList& faults);

  bool parsed() const { return parsed_; }
  pugi::xml_node root() const { return document_.document_element(); }
  /// Line of an element, from 1.
  int LineOf(const pugi::xml_node& node) const;
  /// The start tag of an element in the text, from "<" to ">", as position and length.
  std::pair<std::size_t, std::size_t> StartTag(const pugi::xml_node& node) const;

 private:
  int LineAt(std::ptrdiff_t offset) const;

  pugi::xml_document document_;
  std::string_view text_;
  std::vector<std::ptrdiff_t> line_starts_;
  bool parsed_ = false;
};

/// Finite numbers separated by white space.
/// @return nullopt if the text holds anything else, or another count of them
std::optional<std::vector<double>> NumbersFromText(std::string_view text, std::size_t count);

}  // namespace plumbline::config
