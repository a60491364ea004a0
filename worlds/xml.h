/** XML documents as trees, with the line of each element. */
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace forereach {

class XmlElement final {
 public:
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string text;  ///< All of it between its tags, without that of the elements in it.
  int line = 0;
  std::vector<std::unique_ptr<XmlElement>> children;

  /** The first element of this name in it; null if there is none. */
  [[nodiscard]] const XmlElement* Find(std::string_view child) const;
  [[nodiscard]] std::vector<const XmlElement*> All(std::string_view child) const;
  /** Null if there is none. */
  [[nodiscard]] const std::string* Attribute(std::string_view attribute) const;
};

/** Reads a document without entities of its own: a document type declaration is refused, so that nothing is expanded
and nothing else is read. Elements nest at most 64 deep. @param file its name in messages. @throws ConfigError with the
line.
*/
[[nodiscard]] std::unique_ptr<XmlElement> ReadXml(const std::string& file, std::string_view bytes);

}  // namespace forereach
