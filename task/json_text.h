/** JSON documents as text, and back. The reader, the writer and their templates are compiled in json_text.cpp alone. */
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace forereach {

inline constexpr int kDeepestJson = 32;

/** The document, if it nests at most `deepest` levels and no object has a duplicate key. A deeper document could
overflow the stack where nlohmann copies or writes it; of two values with one key, another reader may take the other.
@tparam Json nlohmann::json or nlohmann::ordered_json.
@throws Json::exception, also for text that is not JSON. */
template <class Json = nlohmann::json>
[[nodiscard]] Json ParseJson(std::string_view text, int deepest = kDeepestJson);

/** What an exception of ParseJson, or of a reader of its document, says of the file: "is no JSON at line 3, column 7".
 */
[[nodiscard]] std::string DescribeJsonError(const std::exception& error);

/** On one line, or with an indent. Strings may have any bytes: those that are not UTF-8 are replaced by U+FFFD. */
template <class Json = nlohmann::json>
[[nodiscard]] std::string JsonText(const Json& json, int indent = -1);

}  // namespace forereach
