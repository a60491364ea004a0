// Errors of the socket: the receiving thread counts them, does not spin, and goes on once they are over. This program's
// own recvmsg stands before the system's.
#include <atomic>
#include <cerrno>

#include <dlfcn.h>
#include <sys/socket.h>

#include "tests/test.h"

#include "bus/udp_receiver.h"
#include "tests/process/process_fixture.h"
#include "tests/process/raw_datagrams.h"

namespace {
std::atomic<int> error_now = 0, calls_with_error = 0;
}

extern "C" ssize_t recvmsg(int socket, msghdr* message, int flags) {
  static auto* const next = reinterpret_cast<ssize_t (*)(int, msghdr*, int)>(::dlsym(RTLD_NEXT, "recvmsg"));
  const int error = error_now;
  if (error == 0) return next(socket, message, flags);
  ++calls_with_error;
  errno = error;
  return -1;
}

namespace forereach::receive_errors_test {

using std::chrono::milliseconds;

struct NoErrorsTest : testing::Test {
  ~NoErrorsTest() override { error_now = 0; }

  template <class Done>
  static bool WaitUntil(Done done) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!done() && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(milliseconds(1));
    return done();
  }

  const std::string url_ = PrivateBusUrl();
  const RawSender sender_{url_};
  std::atomic<int> heard_ = 0;
  UdpReceiver receiver_{ParseMulticastUrl(url_), [this](auto, auto, auto) { ++heard_; }};
};

class ReceiveErrorsTest : public NoErrorsTest, public testing::WithParamInterface<int> {};
INSTANTIATE_TEST_SUITE_P(Errors, ReceiveErrorsTest,
                         testing::Values(ENETDOWN, ENOBUFS, ENOMEM, EHOSTUNREACH, EIO, EBADF),
                         [](const auto& instance) { return "Errno" + std::to_string(instance.param); });

TEST_P(ReceiveErrorsTest, CountsErrorsAndReceivesAgainWithoutSpinning) {
  ASSERT_TRUE(sender_.Send(Bytes(ShortMessage("BEFORE", {}))));
  ASSERT_TRUE(WaitUntil([this] { return heard_ == 1; }));
  const auto begin = std::chrono::steady_clock::now();
  calls_with_error = 0;
  error_now = GetParam();
  ASSERT_TRUE(WaitUntil([this] { return receiver_.counts().receive_errors >= 5; }));
  const int calls = calls_with_error;
  const auto elapsed = std::chrono::steady_clock::now() - begin;
  EXPECT_LE(calls, 2 + elapsed / milliseconds(10)) << "it rests after each";
  ASSERT_TRUE(sender_.Send(Bytes(ShortMessage("MEANWHILE", {}))));
  error_now = 0;
  EXPECT_TRUE(WaitUntil([this] { return heard_ == 2; })) << "it goes on with what has come";
}

TEST_F(NoErrorsTest, DoesNotCountATimeoutOrASignal) {
  for (const int error : {EAGAIN, EINTR}) {
    calls_with_error = 0;
    error_now = error;
    ASSERT_TRUE(WaitUntil([] { return calls_with_error > 3; }));
    error_now = 0;
  }
  EXPECT_EQ(receiver_.counts().receive_errors, 0);
}

}  // namespace forereach::receive_errors_test
