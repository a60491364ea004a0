// Whoever is on the network invents channels and sources: neither memory nor terminal are theirs.
#include <unistd.h>

#include "tests/logger/disk_fixture.h"

namespace forereach::invented_names_test {

const std::vector<std::uint8_t> kData{1, 2, 3};

std::int64_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  std::int64_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * ::sysconf(_SC_PAGESIZE);
}

struct InventedNamesTest : DiskTest {
  // A tick after every hundred, some of them while the disk is full.
  void Invent(int from, int to) {
    for (int i = from; i < to; ++i) {
      const std::string name = "invented channel of forty and more bytes " + std::to_string(i);
      bus_.Publish(name, Bytes(kData));
      bus_.Publish("PLAN_CANDIDATE", MakeCandidate(i, i, "source " + std::to_string(i)));
      free_bytes_ = i % 1000 < 100 ? 0 : std::int64_t{1} << 40;
      if (i % 100 == 0) node_->Tick(bus_.now_us += 10'000);
    }
    free_bytes_ = std::int64_t{1} << 40;
    node_->Tick(bus_.now_us += 10'000);
  }
};

TEST_F(InventedNamesTest, DoNotFillTheMemory) {
  Start();
  node_->Tick(bus_.now_us);
  Invent(0, 20'000);
  const std::int64_t before = ResidentBytes();
  Invent(20'000, 120'000);
  EXPECT_LT(ResidentBytes() - before, std::int64_t{8} << 20) << "10^5 more of each";
  EXPECT_LE(node_->recorder().summary().messages.size(), Summary::kMaxChannels + 1);
  Stop();
}

TEST_F(InventedNamesTest, DoNotReachTheTerminal) {
  Start();
  bus_.Publish("CLEAR\x1b[2J\x9b\n", Bytes(kData));
  node_->Tick(bus_.now_us += 1000);
  Stop();
  EXPECT_THAT(out_.str(), AllOf(HasSubstr("CLEAR\\x1b[2J\\x9b\\x0a 1"), Not(HasSubstr("\x1b"))));
}

}  // namespace forereach::invented_names_test
