#include "bus/bus_url.h"

#include "tests/test.h"

namespace forereach::bus_url_test {

TEST(BusUrlTest, EveryPartIsRead) {
  const MulticastUrl url = ParseMulticastUrl("udpm://224.1.2.3:65535?ttl=255&recv_buf_size=4096");
  EXPECT_FIELDS(url, (group, "224.1.2.3"), (port, 65535), (ttl, 255), (receive_buffer_bytes, 4096));
  EXPECT_EQ(url.ForSending(), "udpm://224.1.2.3:65535?ttl=255") << "LCM's sender receives nothing";
}

TEST(BusUrlTest, PartsLeftOutHaveTheDefaultsOfLcm) {
  for (const char* text : {"udpm://", "udpm://?ttl=0", "udpm://239.255.76.67:7667", "udpm://239.255.76.67:7667?"}) {
    EXPECT_EQ(ParseMulticastUrl(text).ForSending(), "udpm://239.255.76.67:7667?ttl=0") << text;
    EXPECT_EQ(ParseMulticastUrl(text).receive_buffer_bytes, 0) << text;
  }
  EXPECT_EQ(ParseMulticastUrl("udpm://?recv_buf_size=1,ttl=1").ttl, 1) << "a comma separates too";
}

struct Bad {
  const char* url;
  const char* why;
};

TEST(BusUrlTest, AWrongPartIsNamedWithWhatItHasToBe) {
  for (const Bad& bad : {
           Bad{"udp://239.255.76.67:7667", "begin with udpm://"},
           {"udpm://239.255.76.67", "port is missing"},
           {"udpm://239.255.76.67:", "the port \"\""},
           {"udpm://239.255.76.67:0", "the port \"0\" has to be a number from 1 to 65535"},
           {"udpm://239.255.76.67:65536", "the port \"65536\""},
           {"udpm://239.255.76.67:-1", "the port \"-1\""},
           {"udpm://239.255.76.67: 1", "the port \" 1\""},
           {"udpm://239.255.76.67:0x10", "the port \"0x10\""},
           {"udpm://239.255.76.67:99999999999999999999", "the port"},
           {"udpm://239.255.76.67:7667/", "the port \"7667/\""},
           {"udpm://:7667", "the address \"\""},
           {"udpm://localhost:7667", "the address \"localhost\" has to be one of IPv4 multicast"},
           {"udpm://127.0.0.1:7667", "the address \"127.0.0.1\""},
           {"udpm://223.255.255.255:7667", "224.0.0.0 to 239.255.255.255"},
           {"udpm://240.0.0.0:7667", "224.0.0.0 to 239.255.255.255"},
           {"udpm://239.255.76:7667", "the address \"239.255.76\""},
           {"udpm://239.255.76.67 :7667", "the address \"239.255.76.67 \""},
           {"udpm://[ff02::1]:7667", "the address \"[ff02\""},
           {"udpm://?ttl=256", "the ttl \"256\" has to be a number from 0 to 255"},
           {"udpm://?ttl=-1", "the ttl \"-1\""},
           {"udpm://?ttl", "the ttl \"\""},
           {"udpm://?ttl=1=1", "the ttl \"1=1\""},
           {"udpm://?recv_buf_size=0", "the recv_buf_size \"0\""},
           {"udpm://?recv_buf_size=2147483648", "the recv_buf_size \"2147483648\""},
           {"udpm://?ttl=1&ttl=1", "the option ttl is given twice"},
           {"udpm://?tll=1", "the option \"tll\" has to be ttl or recv_buf_size"},
           {"udpm://?&ttl=1", "the option \"\""},
       }) {
    EXPECT_THAT([&] { static_cast<void>(ParseMulticastUrl(bad.url)); },
                ThrowsMessage<BusError>(AllOf(HasSubstr(bad.url), HasSubstr(bad.why), HasSubstr("as in udpm://"))));
  }
}

}  // namespace forereach::bus_url_test
