/** A command as a shell runs it. */
#pragma once

#include <array>
#include <cstdio>
#include <ostream>
#include <string>
#include <type_traits>

#include <sys/wait.h>

#include <gmock/gmock.h>

namespace forereach {

struct Output {
  int code;          ///< -1 if a signal ended it, or if it could not be run.
  std::string text;  ///< Of standard output.

  friend void PrintTo(const Output& output, std::ostream* out) {
    *out << "exit " << output.code << ":\n" << output.text;
  }
};

/** Matches an Output with this code, whose text has each of these words or matches each. */
template <class... Word>
auto Exits(int code, const Word&... words) {
  [[maybe_unused]] const auto matching = []<class Each>(const Each& word) {
    if constexpr (std::is_convertible_v<Each, std::string>)
      return testing::HasSubstr(std::string(word));
    else
      return word;
  };
  return testing::AllOf(testing::Field("code", &Output::code, code),
                        testing::Field("text", &Output::text, testing::AllOf(testing::_, matching(words)...)));
}

inline Output Shell(const std::string& command) {
  Output output{-1, {}};
  std::FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return output;
  std::array<char, 4096> buffer;
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe))
    output.text.append(buffer.data(), size);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) output.code = WEXITSTATUS(status);
  return output;
}

}  // namespace forereach
