#include "page/document.h"

#include <algorithm>
#include <utility>

#include "page/columns.h"
#include "task/json_text.h"

namespace forereach {
namespace {

// For a page, which has data between tags: no tag begins in it.
std::string ForPage(const nlohmann::json& json) {
  const std::string text = JsonText(json);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) c == '<' ? safe += "\\u003c" : safe += c;
  return safe;
}

std::string Hashes(const std::vector<const PageAsset*>& assets) {
  std::string all;
  for (const PageAsset* asset : assets) all += " 'sha256-" + Base64(BytesOf(DigestOfHex(asset->sha256))) + "'";
  return all;
}

// Moves binary values into `columns`, and puts their places there.
void MoveColumns(nlohmann::json& json, std::vector<nlohmann::json::binary_t>& columns) {
  if (json.is_binary()) {
    columns.push_back(std::move(json.get_binary()));
    json = columns.size() - 1;
  } else if (json.is_structured()) {
    for (nlohmann::json& each : json) MoveColumns(each, columns);
  }
}

}  // namespace

std::string PageDocument::Policy() const {
  return "default-src 'none'; base-uri 'none'; form-action 'none'; img-src data:; connect-src " + connect +
         "; style-src" + Hashes(styles) + "; script-src" + Hashes(scripts);
}

std::string PageDocument::Html(nlohmann::json data) const {
  std::vector<nlohmann::json::binary_t> columns;
  MoveColumns(data, columns);
  std::string html = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  html += "<meta http-equiv=\"Content-Security-Policy\" content=\"" + Policy() + "\">\n";
  html += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  html += "<link rel=\"icon\" href=\"data:,\">\n<title>" + title + "</title>\n";
  for (const PageAsset* style : styles) html.append("<style>").append(style->text).append("</style>\n");
  html.append("</head>\n").append(body.text);
  html += "<script type=\"application/json\" id=\"data\">" + ForPage(data) + "</script>\n";
  for (const auto& column : columns)
    html.append("<script type=\"text/plain\" class=\"column\">")
        .append(column.begin(), column.end())
        .append("</script>\n");
  for (const PageAsset* script : scripts) html.append("<script>").append(script->text).append("</script>\n");
  return html + "</body>\n</html>\n";
}

}  // namespace forereach
