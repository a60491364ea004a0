/** What no output of ours has in it: the texts of exceptions of libraries. */
#pragma once

#include <string>

#include "tests/test.h"

namespace forereach {

inline void ExpectNoTextOfALibrary(const std::string& output) {
  std::istringstream texts(
      "json.exception|parse error|type_error|out_of_range|invalid node|bad conversion|end of map|"
      "end of sequence|illegal map|unknown anchor|undefined alias|basic_string|_M_range_check|vector::|"
      "stod|stoi|bad_alloc|bad_optional_access|std::exception|bad_variant_access|bad_function_call|"
      "filesystem error|disk image|file is not a database|no such table|unable to open|At Most");
  for (std::string text; std::getline(texts, text, '|');) EXPECT_THAT(output, Not(HasSubstr(text)));
}

}  // namespace forereach
