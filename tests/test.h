/** What every test is written with: GoogleTest with its usual matchers, JSON, directories of its own, and the standard
library's headers of every day. tests/CMakeLists.txt has them compiled before all tests. */
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/fields.h"
#include "tests/scratch.h"

namespace forereach {

using testing::AllOf, testing::AnyOf, testing::Contains, testing::ContainsRegex, testing::Each, testing::ElementsAre,
    testing::ElementsAreArray, testing::EndsWith, testing::Eq, testing::Ge, testing::Gt, testing::HasSubstr,
    testing::IsEmpty, testing::Le, testing::Lt, testing::MatchesRegex, testing::Not, testing::SizeIs,
    testing::StartsWith, testing::ThrowsMessage, testing::UnorderedElementsAre;

/** Random numbers from a seed that nobody chose: what fails says it. */
class FreshRandom final : public std::mt19937 {
 public:
  explicit FreshRandom(unsigned seed = std::random_device{}(), const char* file = __builtin_FILE(),
                       int line = __builtin_LINE())
      : std::mt19937(seed), trace_(file, line, "seed " + std::to_string(seed)) {}

 private:
  testing::ScopedTrace trace_;
};

/** Matches a JSON object that has these members, each with this value; it may have others. */
MATCHER_P(HasMembers, members, "") {
  for (const auto& [name, value] : members.items())
    if (!arg.contains(name) || arg.at(name) != value) return *result_listener << name << " in " << arg.dump(), false;
  return true;
}
inline auto Holds(nlohmann::json members) { return HasMembers(std::move(members)); }

/** The only entry of a range. @throws std::range_error, which fails the test, if it has none or several. */
const auto& Only(const auto& range) {
  return std::size(range) == 1 ? *std::begin(range)
                               : throw std::range_error(std::to_string(std::size(range)) + " entries, not one");
}

/** What the Error that `call` throws says; empty if it throws none. */
template <class Error, class Call>
std::string Thrown(const Call& call) {
  try {
    call();
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace forereach
