/** Tables that programs print, and write into a page between two marks. */
#pragma once

#include <fstream>
#include <iostream>
#include <sstream>
#include <string>

#include "command_line/command_line.h"

namespace forereach {

/** Replaces what stands between `<!-- NAME -->` and `<!-- end of NAME -->` in a file; appends both where they are
missing. */
inline void ReplaceBetween(const std::string& path, const std::string& name, const std::string& text) {
  const std::string begin = "<!-- " + name + " -->\n", end = "<!-- end of " + name + " -->";
  std::ostringstream old;
  old << std::ifstream(path).rdbuf();
  std::string page = old.str();
  const std::size_t from = page.find(begin), to = page.find(end);
  if (from == std::string::npos || to == std::string::npos || to < from)
    page += begin + text + end + "\n";
  else
    page.replace(from + begin.size(), to - from - begin.size(), text);
  std::ofstream(path) << page;
}

/** The option that says which page. */
inline Option ReportOption(std::string& report) {
  return {.name = "--report", .variable = &report, .help = "Where the table goes; none: to standard output alone"};
}

inline void Publish(const std::string& report, const std::string& name, const std::string& table) {
  std::cout << table << std::flush;
  if (report != "none") ReplaceBetween(report, name, table);
}

}  // namespace forereach
