// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

/// An element of an XML document.
struct XmlElement {
  std::string name, text;  ///< Text of its own, without that of children.
  std::map<std::string, std::string> attributes;
  std::vector<XmlElement> children;

  const XmlElement* child(std::string_view child_name) const;
  /// Empty if it has none of this name.
  std::string attribute(const std::string& attribute_name) const;
};

/// The root of a document. Entities are refused where they are declared, nothing outside of the
/// text is ever read; error also for more than 100,000 elements or 32 levels. Place is the line.
Result<XmlElement> parseXml(std::string_view text, const std::string& file);

}  // namespace tenter
