// SPDX-License-Identifier: GPL-3.0-or-later
#include "xml_tree.h"

#include <expat.h>

#include <memory>

namespace tenter {

namespace {

constexpr std::size_t kMaxElements = 100000, kMaxDepth = 32;

struct Builder {
  XML_Parser parser = nullptr;
  XmlElement document;            ///< The root is its only child.
  std::vector<std::size_t> path;  ///< Child numbers from the document to the open element.
  std::size_t elements = 0;
  std::string refusal;

  XmlElement& open() {
    XmlElement* at = &document;
    for (const std::size_t child : path) at = &at->children[child];
    return *at;
  }
  void refuse(const std::string& reason) {
    if (refusal.empty()) refusal = reason;
    XML_StopParser(parser, XML_FALSE);
  }
};

void onStart(void* data, const XML_Char* name, const XML_Char** attributes) {
  auto& b = *static_cast<Builder*>(data);
  if (++b.elements > kMaxElements) return b.refuse("has too many elements");
  if (b.path.size() >= kMaxDepth) return b.refuse("is nested too deeply");
  XmlElement element;
  element.name = name;
  for (; *attributes != nullptr; attributes += 2) element.attributes[attributes[0]] = attributes[1];
  XmlElement& parent = b.open();
  parent.children.push_back(std::move(element));
  b.path.push_back(parent.children.size() - 1);
}

void onEnd(void* data, const XML_Char* /*name*/) {
  auto& b = *static_cast<Builder*>(data);
  if (!b.path.empty()) b.path.pop_back();
}

void onText(void* data, const XML_Char* text, int length) {
  auto& b = *static_cast<Builder*>(data);
  if (!b.path.empty()) b.open().text.append(text, static_cast<std::size_t>(length));
}

void onEntity(void* data, const XML_Char* /*name*/, int /*is_parameter*/, const XML_Char* /*value*/,
              int /*length*/, const XML_Char* /*base*/, const XML_Char* /*system*/,
              const XML_Char* /*public*/, const XML_Char* /*notation*/) {
  static_cast<Builder*>(data)->refuse("declares entities, which are not read");
}

}  // namespace

const XmlElement* XmlElement::child(std::string_view child_name) const {
  for (const XmlElement& element : children) {
    if (element.name == child_name) return &element;
  }
  return nullptr;
}

std::string XmlElement::attribute(const std::string& attribute_name) const {
  const auto found = attributes.find(attribute_name);
  return found == attributes.end() ? "" : found->second;
}

Result<XmlElement> parseXml(std::string_view text, const std::string& file) {
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(
      XML_ParserCreate(nullptr), &XML_ParserFree);
  require(parser != nullptr, "expat has memory for a parser");
  Builder builder;
  builder.parser = parser.get();
  XML_SetUserData(parser.get(), &builder);
  XML_SetElementHandler(parser.get(), onStart, onEnd);
  XML_SetCharacterDataHandler(parser.get(), onText);
  XML_SetEntityDeclHandler(parser.get(), onEntity);
  const auto status = XML_Parse(parser.get(), text.data(), static_cast<int>(text.size()), XML_TRUE);
  const std::string place = "line " + std::to_string(XML_GetCurrentLineNumber(parser.get()));
  if (!builder.refusal.empty()) return badInput(file, place, builder.refusal);
  if (status != XML_STATUS_OK) {
    return badInput(
        file, place,
        std::string("is not valid XML: ") + XML_ErrorString(XML_GetErrorCode(parser.get())));
  }
  return std::move(builder.document.children.front());
}

}  // namespace tenter
