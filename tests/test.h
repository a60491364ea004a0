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

#include "tests/scratch.h"

namespace forereach {

using testing::AllOf, testing::AnyOf, testing::ElementsAre, testing::EndsWith, testing::HasSubstr, testing::IsEmpty,
    testing::Not, testing::StartsWith, testing::ThrowsMessage;

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
