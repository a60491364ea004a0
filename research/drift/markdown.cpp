#include "research/drift/markdown.h"

namespace forereach::research {

std::string Markdown(const Cells& head, const std::vector<Cells>& rows) {
  const auto line = [](const Cells& cells) {
    std::string text = "|";
    for (const std::string& cell : cells) text.append(" ").append(cell).append(" |");
    return text + "\n";
  };
  std::string text = "\n";
  text += line(head) + "|";
  for (std::size_t i = 0; i < head.size(); ++i) text += "---|";
  text += "\n";
  for (const Cells& row : rows) text += line(row);
  return text;
}

}  // namespace forereach::research
