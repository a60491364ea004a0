#include "research/origin.h"

#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>

namespace forereach::research {
namespace {

// What `git ARGUMENTS` prints in the source tree, without the last line's end; empty if it fails.
std::string Git(const std::string& arguments) {
  const std::string command = "TZ=UTC git -C '" FOREREACH_SOURCE_DIR "' " + arguments + " 2>/dev/null";
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string text;
  char part[256];
  while (pipe && std::fgets(part, sizeof part, pipe.get())) text += part;
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

std::string Now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M", &parts);
  return text;
}

std::string Processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

std::string Compiler() {
#ifdef __clang__
  return "clang " __clang_version__;
#else
  return "g++ " __VERSION__;
#endif
}

}  // namespace

Origin OriginOf(const std::string& command, unsigned threads) {
  std::string commit = Git("rev-parse HEAD");
  if (commit.empty())
    commit = "unknown";
  else if (!Git("status --porcelain --untracked-files=no -- ':!docs' ':!research/*.md' ':!research/figures'").empty())
    commit += ", with changes";
  std::string committed = Git("log -1 --date=format-local:'%Y-%m-%d %H:%M' --format=%cd");
  return {command, commit, committed, Now(), Compiler(), Processor(), threads};
}

std::string ToMarkdown(const Origin& origin) {
  return std::string(kOriginBegins) + "\n| | |\n|---|---|\n| command | `" + origin.command + "` |\n| commit | " +
         origin.commit + (origin.committed.empty() ? "" : ", of " + origin.committed + " UTC") + " |\n| date | " +
         origin.date + " UTC |\n| compiler | " + origin.compiler + " |\n| processor | " + origin.processor + ", " +
         std::to_string(origin.threads) + (origin.threads == 1 ? " thread" : " threads") + " |\n" + kOriginEnds + "\n";
}

}  // namespace forereach::research
