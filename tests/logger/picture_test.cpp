#include "logger/picture.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/logger/logs.h"

namespace forereach {
namespace {

Picture Sample() {
  Picture picture;
  picture.title = "Title";
  picture.key_numbers = {"1 plan"};
  picture.circles = {{{5, 3}, 1}};
  picture.polygons = {{{0, 5}, {1, 5}, {1, 6}}};
  picture.half_planes = {{{0, -1}, 4}};
  picture.executed = {{{0, 0}, {1, 0}, {1, 1}}};
  picture.certified = {{{2, 0}, {3, 0}, {3, 1}}};
  picture.abstained = {{}, {{{4, 0}, {5, 0}, {5, 1}}}};
  picture.path = {{0, 0}, {3, 0.5}};
  picture.stops = {{1, 0}};
  picture.goal = Picture::Circle{{9, 0}, 1};
  return picture;
}

TEST(Picture, WritesBothFormats) {
  const ScratchDirectory scratch;
  DrawPicture(Sample(), scratch / "a.svg");
  DrawPicture(Sample(), scratch / "a.png", 600, 400);
  const std::vector<std::uint8_t> svg = ReadBytes(scratch / "a.svg"), png = ReadBytes(scratch / "a.png");
  EXPECT_THAT(std::string(svg.begin(), svg.end()), testing::HasSubstr("</svg>"));
  ASSERT_GT(png.size(), 24u);
  EXPECT_EQ(std::string(png.begin() + 1, png.begin() + 4), "PNG");
  EXPECT_EQ(png[18] << 8 | png[19], 600);
  EXPECT_EQ(png[22] << 8 | png[23], 400);
}

TEST(Picture, SameInputSameBytes) {
  const ScratchDirectory scratch;
  DrawPicture(Sample(), scratch / "a.png");
  DrawPicture(Sample(), scratch / "b.png");
  EXPECT_EQ(ReadBytes(scratch / "a.png"), ReadBytes(scratch / "b.png"));
  Picture other = Sample();
  other.circles[0].radius = 1.2;
  DrawPicture(other, scratch / "c.png");
  EXPECT_NE(ReadBytes(scratch / "a.png"), ReadBytes(scratch / "c.png"));
}

TEST(Picture, DrawsNothingAndDegenerateThings) {
  const ScratchDirectory scratch;
  EXPECT_NO_THROW(DrawPicture({}, scratch / "empty.svg"));
  Picture picture;
  picture.path = {{1, 1}};
  picture.executed = {{{1, 1}}, {}};
  picture.circles = {{{NAN, 0}, 1}, {{0, 0}, 0}};
  EXPECT_NO_THROW(DrawPicture(picture, scratch / "point.png"));
}

TEST(Picture, SaysWhatItCannotWrite) {
  const ScratchDirectory scratch;
  EXPECT_THROW(DrawPicture({}, scratch / "a.jpg"), PictureError);
  EXPECT_THROW(DrawPicture({}, scratch / "a.png", 100, 800), PictureError);
  EXPECT_THROW(DrawPicture({}, scratch / "no/such/a.png"), PictureError);
  EXPECT_THROW(DrawPicture({}, scratch / "no/such/a.svg"), PictureError);
}

}  // namespace
}  // namespace forereach
