// What a process tells systemd that started it.
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "tests/test.h"

#include "tests/process/process_fixture.h"

namespace forereach::service_test {

// The socket on which systemd hears services.
class NotifySocket final {
 public:
  explicit NotifySocket(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    const timeval patience{kPatience.count(), 0};
    EXPECT_EQ(::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience), 0);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << path;
  }
  ~NotifySocket() { ::close(socket_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  /** The next message; empty if none comes. */
  [[nodiscard]] std::string Next() {
    std::array<char, 256> text;
    const ssize_t size = ::recv(socket_, text.data(), text.size(), 0);
    return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "";
  }

 private:
  const int socket_ = ::socket(AF_UNIX, SOCK_DGRAM, 0);
};

std::vector<std::string> Started(const std::string& socket, const std::vector<std::string>& environment,
                                 const std::string& task) {
  std::vector<std::string> command{"/usr/bin/env", "NOTIFY_SOCKET=" + socket};
  command.insert(command.end(), environment.begin(), environment.end());
  for (const std::string each : {FOREREACH_CERTIFIER, "--config", task.c_str(), "--lcm-url"}) command.push_back(each);
  command.push_back(PrivateBusUrl());
  return command;
}

TEST(Service, SaysThatItIsReadyThatItsLoopTurnsAndThatItStops) {
  const ScratchDirectory scratch;
  NotifySocket systemd(scratch / "notify");
  ChildProcess certifier(
      Started(scratch / "notify", {"WATCHDOG_USEC=200000"}, scratch.Write("task.yaml", PatientTask())));
  EXPECT_EQ(systemd.Next(), "READY=1") << certifier.error();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(systemd.Next(), "WATCHDOG=1");
  EXPECT_EQ(certifier.Terminate(), 0);
  std::string last = systemd.Next();
  while (last == "WATCHDOG=1") last = systemd.Next();
  EXPECT_EQ(last, "STOPPING=1");
}

TEST(Service, SaysNothingOfItsLoopUnasked) {
  const ScratchDirectory scratch;
  NotifySocket systemd(scratch / "notify");
  ChildProcess certifier(Started(scratch / "notify", {}, scratch.Write("task.yaml", PatientTask())));
  EXPECT_EQ(systemd.Next(), "READY=1") << certifier.error();
  EXPECT_EQ(certifier.Terminate(), 0);
  EXPECT_EQ(systemd.Next(), "STOPPING=1");
}

TEST(Service, IsNotReadyWithABadTask) {
  const ScratchDirectory scratch;
  NotifySocket systemd(scratch / "notify");
  ChildProcess certifier(Started(scratch / "notify", {}, scratch.Write("task.yaml", "model: none\n")));
  EXPECT_EQ(certifier.WaitForExit(), 2);
  ChildProcess good(Started(scratch / "notify", {}, scratch.Write("good.yaml", PatientTask())));
  EXPECT_EQ(systemd.Next(), "READY=1") << "the first message is the good one's";
  EXPECT_EQ(good.Terminate(), 0);
}

}  // namespace forereach::service_test
