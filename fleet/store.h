/** The fleet's store: the rows of many robots in one PostgreSQL 15. Only its source file sees libpqxx.

The tables are those of records/schema.h, each row with its robot in front. A row's key is robot, log file, event number
and the event's own time, and a row that is there is not written again, so whoever sends, and however often, the store
has each row once. `run_states` has a row for each state of a log file that was sent, and the view `runs` the last one.
The tables of rows are partitioned by the month of the event's own time; other times than 2020 to 2099 share one part.

**Roles.** Tables belong to who makes them. A member of forereach_robot may add rows of the robot that is named as the
member is, and read them; it may change and delete none. A member of forereach_reader may read all rows.

**Text.** PostgreSQL's text has no zero byte and no invalid character, and a log's may have any: each byte that is not
printable ASCII, and the backslash, is written as \xHH. A number that is not one (NaN) is NULL, as in SQLite. */
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/bad_input.h"
#include "records/database.h"
#include "records/rows.h"

namespace forereach {

/** The store refuses something. The text says what, and never what the server's message says. */
class StoreError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** The server is not there, or was lost: what was sent last is there whole or not at all, and may be sent again. */
class StoreAway : public StoreError {
 public:
  using StoreError::StoreError;
};

class Store final {
 public:
  /** Speaks to no server yet: each call below connects if it has to, and makes the tables if there are none.
  @param address postgresql://..., with libpq's parameters. It is shown nowhere.
  @throws StoreError if it is no such address, or has a password, which the command line would show to everyone. */
  explicit Store(const std::string& address);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /** Whether --database names a store, and no file. */
  [[nodiscard]] static bool IsAddress(const std::string& database);

  /** Adds the rows, and the states of runs, that are not there, in one transaction. When it returns they are on the
  server's disk. @return the number of new rows. @throws StoreError if another event of the same number and time is
  there: two logs of one name. Then nothing is written. */
  std::int64_t Write(const std::string& robot, const Rows& rows, const std::vector<RunRow>& runs = {});

  /** The last state of each run of a robot, in the order in which they began. */
  [[nodiscard]] std::vector<RunRow> Runs(const std::string& robot);
  [[nodiscard]] RowCounts Count(const std::string& robot, const std::string& log_file);
  /** In the order of their events. */
  [[nodiscard]] Rows Read(const std::string& robot, const std::string& log_file);

  /** The next transitions of all robots, each behind its robot's name, in the order of robot, log and event.
  @param after the last one of the call before; none: from the first one on. */
  using OfRobot = std::pair<std::string, TransitionRow>;
  struct WhichTransitions {
    std::string robot;                                 ///< Empty: of all robots.
    std::int64_t from = INT64_MIN, until = INT64_MAX;  ///< The events' own times: from <= time < until.
  };
  [[nodiscard]] std::vector<OfRobot> ReadTransitions(const WhichTransitions& which, const OfRobot* after, int most);

  /** The rows of a query, as PostgreSQL writes values; no value is NULL. Nothing is written. */
  using Values = std::vector<std::optional<std::string>>;
  [[nodiscard]] std::vector<Values> Query(const std::string& sql);

 private:
  class Connection;

  // Calls work(connection), and takes the library's exceptions for ours.
  auto With(const auto& work);
  void MakeMonths(Connection& connection, const Rows& rows);

  std::string parameters_;
  std::unique_ptr<Connection> connection_;  // nothing while there is none
  std::set<int> months_;                    // whose parts are known to be there
};

/** A text as the store holds it, and back. */
[[nodiscard]] std::string ToStoredText(const std::string& text);
[[nodiscard]] std::string FromStoredText(const std::string& text);

}  // namespace forereach
