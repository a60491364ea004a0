#include "records/picture.h"
#include "records/output_file.h"

#include "tests/records/logs.h"

namespace forereach::picture_test {

Picture Sample() {
  Picture picture{.title = "Title", .key_numbers = {"1 plan"}};
  using Eigen::Vector2d;
  picture.obstacles = {Obstacle::Circle(Vector2d(5, 3), 1),
                       Obstacle::Polygon({Vector2d(0, 5), Vector2d(1, 5), Vector2d(1, 6)}),
                       Obstacle::HalfSpace(Vector2d(0, -1), 4)};
  picture.executed = {{{0, 0}, {1, 0}, {1, 1}}};
  picture.certified = {{{2, 0}, {3, 0}, {3, 1}}};
  picture.abstained = {{}, {{{4, 0}, {5, 0}, {5, 1}}}};
  picture.path = {{0, 0}, {3, 0.5}};
  picture.stops = {{1, 0}};
  picture.goal = Picture::Circle{{9, 0}, 1};
  return picture;
}

TEST(Picture, WritesSvgAndPng) {
  const ScratchDirectory scratch;
  DrawPicture(Sample(), scratch / "a.svg");
  DrawPicture(Sample(), scratch / "a.png", 600, 400);
  const std::vector<std::uint8_t> svg = ReadBytes(scratch / "a.svg"), png = ReadBytes(scratch / "a.png");
  EXPECT_THAT(std::string(svg.begin(), svg.end()), HasSubstr("</svg>"));
  ASSERT_GT(png.size(), 24u);
  EXPECT_EQ(std::string(png.begin() + 1, png.begin() + 4), "PNG");
  EXPECT_EQ(png[18] << 8 | png[19], 600);
  EXPECT_EQ(png[22] << 8 | png[23], 400);
}

TEST(Picture, ALongTitleIsWrittenSmaller) {
  const ScratchDirectory scratch;
  Picture picture = Sample();
  DrawPicture(picture, scratch / "short.svg");
  picture.title = std::string(120, 'm');
  DrawPicture(picture, scratch / "long.svg");
  const std::vector<std::uint8_t> short_title = ReadBytes(scratch / "short.svg"),
                                  long_title = ReadBytes(scratch / "long.svg");
  EXPECT_THAT(std::string(short_title.begin(), short_title.end()), HasSubstr("font-size=\"19\""));
  EXPECT_THAT(std::string(long_title.begin(), long_title.end()), HasSubstr("font-size=\"15.5"));
}

TEST(Picture, TheSameInputGivesTheSameBytes) {
  const ScratchDirectory scratch;
  DrawPicture(Sample(), scratch / "a.png");
  DrawPicture(Sample(), scratch / "b.png");
  EXPECT_EQ(ReadBytes(scratch / "a.png"), ReadBytes(scratch / "b.png"));
  Picture other = Sample();
  other.obstacles[0] = Obstacle::Circle(Eigen::Vector2d(5, 3), 1.2);
  DrawPicture(other, scratch / "c.png");
  EXPECT_NE(ReadBytes(scratch / "a.png"), ReadBytes(scratch / "c.png"));
}

TEST(Picture, DrawsAnEmptyPictureAndDegenerateShapes) {
  const ScratchDirectory scratch;
  EXPECT_NO_THROW(DrawPicture({}, scratch / "empty.svg"));
  Picture picture{
      .obstacles = {Obstacle::Circle(Eigen::Vector2d(1e300, 0), 1), Obstacle::Circle(Eigen::Vector2d(0, 0), 0)},
      .executed = {{{1, 1}}, {}},
      .path = {{1, 1}},
      .bodies = {{{NAN, 0}, {1, 1}, {0, 1}}}};
  EXPECT_NO_THROW(DrawPicture(picture, scratch / "point.png"));
}

TEST(Picture, SaysWhatItCannotWrite) {
  const ScratchDirectory scratch;
  EXPECT_THROW(DrawPicture({}, scratch / "a.jpg"), PictureError);
  EXPECT_THROW(DrawPicture({}, scratch / "a.png", 100, 800), PictureError);
  EXPECT_THROW(DrawPicture({}, scratch / "no/such/a.png"), OutputError);
  EXPECT_THROW(DrawPicture({}, scratch / "no/such/a.svg"), OutputError);
}

TEST(Picture, FilesAreThoseOfTheNameOrRefusedWithASentence) {
  using Files = std::vector<std::string>;
  const ScratchDirectory scratch;
  const auto in = [&](const std::string& name) { return scratch / name; };
  EXPECT_EQ(PictureFiles(in("a.svg")), Files{in("a.svg")});
  EXPECT_EQ(PictureFiles(in("a.png")), Files{in("a.png")});
  EXPECT_EQ(PictureFiles(in("a")), (Files{in("a.svg"), in("a.png")}));
  const auto refused = [](const std::string& name, const std::string& why) {
    EXPECT_THAT([&] { (void)PictureFiles(name); }, ThrowsMessage<PictureError>(HasSubstr(why)));
  };
  for (const char* ending : {".jpg", ".pdf", ".PNG", ".v2", "."})
    refused(in(std::string("a") + ending), std::string("ends in ") + ending + "; it has to end in .svg or .png");
  refused(in("none/a.svg"), "there is no directory " + in("none"));
  refused(in(""), "names no file");
  refused("", "names no file");
  std::filesystem::create_directory(in("b.svg"));
  refused(in("b.svg"), "b.svg is a directory");
  refused(in("b"), "b.svg is a directory");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1) << "no file is touched";
}

}  // namespace forereach::picture_test
