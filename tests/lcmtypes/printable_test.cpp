#include "lcmtypes/printable.h"

#include "tests/test.h"

namespace forereach::printable_test {

TEST(PrintableTest, LeavesOrdinaryTextUnchanged) {
  for (const char* text : {"", "PLAN_CANDIDATE", "a b/c~", "Stra\u00dfe, \u03b8, \u4e16, \U0001F916"}) {
    EXPECT_EQ(Printable(text), text);
    EXPECT_EQ(PrintableLines(text), text);
  }
}

TEST(PrintableTest, WhatCommandsATerminalIsEscaped) {
  EXPECT_EQ(Printable("\x1b[2J"), "\\x1b[2J");
  EXPECT_EQ(Printable(std::string_view("\0\a\b\t\n\r\x7f", 7)), "\\x00\\x07\\x08\\x09\\x0a\\x0d\\x7f");
  EXPECT_EQ(Printable("\xc2\x9b"
                      "31m"),
            "\\xc2\\x9b31m")
      << "the same introducer in one character";
  EXPECT_EQ(Printable("\xe2\x80\xae"
                      "abc"),
            "\\xe2\\x80\\xae"
            "abc")
      << "right to left";
  EXPECT_EQ(PrintableLines("a\nb\x1b\r\n"), "a\nb\\x1b\\x0d\n");
}

TEST(PrintableTest, WhatIsNoUtf8IsEscaped) {
  EXPECT_EQ(Printable("\x9b"
                      "31m"),
            "\\x9b31m");
  EXPECT_EQ(Printable("\xc1\xbf\xe0\x80\x80\xed\xa0\x80\xf5\x80\x80\x80"),
            "\\xc1\\xbf\\xe0\\x80\\x80\\xed\\xa0\\x80\\xf5\\x80\\x80\\x80");
  EXPECT_EQ(Printable("\xe2\x82"), "\\xe2\\x82") << "cut";
}

TEST(PrintableTest, GivesOnlyPrintableTextForRandomBytes) {
  std::mt19937 random(1);
  for (int i = 0; i < 20'000; ++i) {
    std::string text(random() % 40, '\0');
    for (char& c : text) c = static_cast<char>(random());
    for (const char c : Printable(text)) EXPECT_TRUE(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f);
    EXPECT_EQ(Printable(Printable(text)), Printable(text));
  }
}

}  // namespace forereach::printable_test
