/** What a report is from. */
#pragma once

#include <string>

namespace forereach::research {

/** One run of the program. Everything in it may differ between runs that give the same figures. */
struct Origin {
  std::string command, commit, committed, date, compiler, processor;
  unsigned threads = 1;
};

/** Of this process, now: the commit of the source tree that it was built from, "unknown" without git, with a word where
that tree has changes; the dates in UTC. */
[[nodiscard]] Origin OriginOf(const std::string& command, unsigned threads);

/** @name Lines about a report's origin, the only part of it that differs between runs with the same figures. */
///@{
inline constexpr const char* kOriginBegins = "<!-- origin: differs from run to run -->";
inline constexpr const char* kOriginEnds = "<!-- end of origin -->";
[[nodiscard]] std::string ToMarkdown(const Origin& origin);
///@}

}  // namespace forereach::research
