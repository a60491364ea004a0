/** Why something failed, in words of ours. */
#pragma once

#include <exception>
#include <string>

namespace forereach {

/** The text of a BadInput, a std::invalid_argument or a plain std::runtime_error, which are ours. The text of another
exception is its library's, and names neither a file nor what to do: it is replaced by a sentence. */
[[nodiscard]] std::string WhyFailed(const std::exception& error);

}  // namespace forereach
