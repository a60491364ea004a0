#include "page/document.h"

#include <algorithm>
#include <array>
#include <bit>
#include <new>
#include <utility>

#include <zlib.h>

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
  // A page runs its own scripts alone, by their hashes, whatever is in the log that it shows.
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

static_assert(std::endian::native == std::endian::little, "columns are written as they lie in memory");

Digest DigestOfHex(std::string_view hex) {
  const auto value = [](char c) { return '0' <= c && c <= '9' ? c - '0' : 'a' <= c && c <= 'f' ? c - 'a' + 10 : -1; };
  Digest digest{};
  if (hex.size() != kHexDigits || std::ranges::any_of(hex, [&](char c) { return value(c) < 0; })) return digest;
  for (std::size_t i = 0; i < digest.size(); ++i)
    digest[i] = static_cast<std::uint8_t>(value(hex[2 * i]) << 4 | value(hex[2 * i + 1]));
  return digest;
}

std::string Base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(bytes.size() - i, 3);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

struct Packer::Stream : z_stream {};

Packer::Packer() : stream_(std::make_unique<Stream>()) {
  if (deflateInit(stream_.get(), Z_DEFAULT_COMPRESSION) != Z_OK) throw std::bad_alloc();
}

Packer::~Packer() { deflateEnd(stream_.get()); }

void Packer::Deflate(std::string_view bytes, bool is_last) {
  std::array<Bytef, 1 << 15> block;
  stream_->next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream_->avail_in = static_cast<uInt>(bytes.size());
  do {
    stream_->next_out = block.data();
    stream_->avail_out = block.size();
    deflate(stream_.get(), is_last ? Z_FINISH : Z_NO_FLUSH);
    packed_.append(reinterpret_cast<const char*>(block.data()), block.size() - stream_->avail_out);
  } while (stream_->avail_out == 0);
}

nlohmann::json Packer::Finish() {
  Deflate({}, true);
  const std::string text = Base64(std::exchange(packed_, {}));
  return nlohmann::json::binary({text.begin(), text.end()});
}

}  // namespace forereach
