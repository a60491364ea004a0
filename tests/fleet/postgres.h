/** A PostgreSQL of a test's own, in a folder and on a socket there. As root it runs as nobody, as it refuses root. */
#pragma once

#include <csignal>

#include <unistd.h>

#include "tests/paths.h"
#include "tests/process/child_process.h"
#include "tests/shell.h"
#include "tests/test.h"

namespace forereach {

class Postgres final {
 public:
  /** Where the server's programs are; empty if it is not installed. */
  [[nodiscard]] static std::string Programs() {
    for (const char* version : {"15", "16", "17"})
      if (const std::string path = std::string("/usr/lib/postgresql/") + version + "/bin/";
          std::filesystem::exists(path + "postgres"))
        return path;
    return {};
  }

  /** What begins a command that runs as the server does. */
  [[nodiscard]] static std::string AsUser() {
    return geteuid() == 0 ? FOREREACH_SOURCE_DIR "/tests/fleet/as_nobody " : "";
  }

  /** Makes the server's files, with the database `fleet` of the user `owner`, and starts it. */
  Postgres() {
    std::filesystem::permissions(scratch_.path(), std::filesystem::perms(0755));
    std::filesystem::create_directory(folder_);
    if (geteuid() == 0) {
      EXPECT_EQ(Shell("chown nobody " + folder_).code, 0);
    }
    const Output made = Shell(FOREREACH_SOURCE_DIR "/tests/fleet/server_files " + Programs() +
                              " " FOREREACH_BINARY_DIR "/tests/fleet " + folder_ + " 2>&1");
    EXPECT_EQ(made.code, 0) << made.text;
    Start();
  }
  ~Postgres() {
    if (server_) server_->Signal(SIGINT);
    if (server_) static_cast<void>(server_->WaitForEnd(kPatience));
  }
  Postgres(const Postgres&) = delete;
  Postgres& operator=(const Postgres&) = delete;

  /** Returns when it takes connections. After a kill its other processes may have to end first. */
  void Start() {
    for (int attempt = 0; attempt < 100; ++attempt) {
      std::vector<std::string> command;
      std::istringstream words(AsUser());
      for (std::string word; words >> word;) command.push_back(word);
      for (const std::string& word : {Programs() + "postgres", std::string("-D"), folder_ + "/data", std::string("-k"),
                                      folder_, std::string("-c"), std::string("listen_addresses="), std::string("-F")})
        command.push_back(word);
      server_ = std::make_unique<ChildProcess>(command);
      if (server_->WaitForLog("ready to accept connections")) return;
      last_ = server_->error();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    FAIL() << "PostgreSQL does not start: " << last_;
  }
  /** As a power failure of the server's machine does, with its disk's cache intact. */
  void Kill() {
    server_->Signal(SIGKILL);
    EXPECT_TRUE(server_->WaitForEnd(kPatience));
  }

  [[nodiscard]] std::string Address(const std::string& user = "owner") const {
    return "postgresql:///fleet?host=" + folder_ + "&user=" + user;
  }
  [[nodiscard]] const std::string& folder() const { return folder_; }

  /** What psql prints for a statement, values separated by |. */
  Output Sql(const std::string& statement, const std::string& user = "owner", const std::string& database = "fleet") {
    const std::string file = scratch_.Write("statement.sql", statement);
    return Shell(Programs() + "psql -X -q -At -v ON_ERROR_STOP=1 -h " + folder_ + " -U " + user + " -d " + database +
                 " -f " + file + " 2>&1");
  }

 private:
  const ScratchDirectory scratch_;
  const std::string folder_ = scratch_ / "server";
  std::unique_ptr<ChildProcess> server_;
  std::string last_;
};

/** A test with a server; skipped where PostgreSQL is not installed. */
class PostgresTest : public testing::Test {
 protected:
  void SetUp() override {
    if (Postgres::Programs().empty()) GTEST_SKIP() << "PostgreSQL is not installed";
    if (Shell(Postgres::AsUser() + "true").code != 0)
      GTEST_SKIP() << "PostgreSQL refuses root, and only root may enter /";
    server_.emplace();
  }

  std::optional<Postgres> server_;
};

}  // namespace forereach
