/** Statements on a database of decisions. */
#pragma once

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sqlite3.h>

namespace forereach {

/** The rows of a statement's result, as texts; what is NULL is empty. */
inline std::vector<std::vector<std::string>> Sql(const std::string& path, const std::string& statement) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [](void* all, int count, char** values, char**) {
    auto& row = static_cast<decltype(rows)*>(all)->emplace_back();
    for (int i = 0; i < count; ++i) row.emplace_back(values[i] ? values[i] : "");
    return 0;
  };
  sqlite3* handle = nullptr;
  EXPECT_EQ(sqlite3_open(path.c_str(), &handle), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(handle, statement.c_str(), add, &rows, nullptr), SQLITE_OK)
      << statement << ": " << sqlite3_errmsg(handle);
  sqlite3_close(handle);
  return rows;
}

}  // namespace forereach
