/** Words of a task file and the values that they stand for. */
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/core.h>

namespace forereach::key_rows {

template <class T>
struct Named {
  std::string_view name;
  T value;
};

template <class T>
std::vector<std::string_view> NamesIn(const std::vector<Named<T>>& all) {
  std::vector<std::string_view> names;
  for (const Named<T>& named : all) names.push_back(named.name);
  return names;
}

/** The value with a name. @throws std::logic_error if there is none; the check of the row excludes that. */
template <class T>
const T& ValueNamed(const std::vector<Named<T>>& all, std::string_view name) {
  const auto found = std::ranges::find(all, name, &Named<T>::name);
  if (found == all.end()) throw std::logic_error(fmt::format("a word that the schema does not have: {}", name));
  return found->value;
}

}  // namespace forereach::key_rows
