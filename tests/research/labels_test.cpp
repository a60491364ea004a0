// Labels meet neither each other nor a mark, and stay in the frame.
#include "research/labels.h"

#include "tests/test.h"

#include "tests/oracle/traced_random.h"

namespace forereach::research::labels_test {

constexpr PixelBox kFrame{100, 50, 500, 450};
constexpr double kRadius = 5, kClearance = 7;

PixelBox MarkAt(double x, double y) { return {x - kRadius, y - kRadius, x + kRadius, y + kRadius}; }

double Distance(const PixelBox& box, const Label& label) {
  return std::hypot(std::max({box.left - label.x, label.x - box.right, 0.0}),
                    std::max({box.bottom - label.y, label.y - box.top, 0.0}));
}

TEST(Labels, OfClustersOverlapNothing) {
  for (TracedRandom random(18); random.Again(100);) {
    std::vector<PixelBox> marks;
    std::vector<Label> labels;
    // Some on one spot, some at the frame's edges.
    const double x = random.Uniform(100, 500), y = random.Uniform(50, 450);
    for (int i = 0; i < 30; ++i) {
      const bool is_clustered = i % 3 == 0;
      labels.push_back({is_clustered ? x + random.Uniform(-3, 3) : random.Uniform(100, 500),
                        is_clustered ? y : random.Uniform(50, 450), i % 2 == 0 ? "25" : "100, 400"});
      marks.push_back(MarkAt(labels.back().x, labels.back().y));
    }
    const std::vector<PixelBox> boxes = PlaceLabels(kFrame, marks, {}, labels, kClearance);
    ASSERT_EQ(boxes.size(), labels.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const PixelBox& box = boxes[i];
      EXPECT_TRUE(kFrame.Holds(box));
      // Arial's digits are 0.556 of its size wide.
      EXPECT_GE(box.right - box.left, 0.556 * kLabelSize * static_cast<double>(labels[i].text.size()));
      EXPECT_GE(box.top - box.bottom, kLabelSize);
      for (const PixelBox& mark : marks) EXPECT_FALSE(box.Meets(mark));
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_FALSE(box.Meets(boxes[j])) << labels[i].text << " and " << labels[j].text;
    }
  }
}

TEST(Labels, OfALoneMarkIsBesideIt) {
  const std::vector<Label> labels{{300, 200, "25"}};
  const std::vector<PixelBox> marks{MarkAt(300, 200)};
  EXPECT_NEAR(Distance(PlaceLabels(kFrame, marks, {}, labels, kClearance).front(), labels.front()), kClearance, 1e-9);
}

TEST(Labels, GoOutOfALinesWay) {
  const std::vector<Label> labels{{300, 200, "25"}};
  const std::vector<PixelBox> marks{MarkAt(300, 200)};
  const std::vector<PixelBox> lines{{100, 199, 500, 201}, {299, 50, 301, 450}};
  const std::vector<PixelBox> boxes = PlaceLabels(kFrame, marks, lines, labels, kClearance);
  for (const PixelBox& line : lines) EXPECT_FALSE(boxes.front().Meets(line));
  EXPECT_LT(Distance(boxes.front(), labels.front()), 2 * kClearance);
}

TEST(Labels, WithoutRoomAreAnError) {
  const std::vector<Label> labels{{1, 10, "25"}, {1, 10, "100"}};
  EXPECT_THAT(
      [&] {
        (void)PlaceLabels({0, 0, 20, 20}, {}, {}, labels, 1);
      },
      ThrowsMessage<std::runtime_error>("picture: no room for the label 100"));
}

}  // namespace forereach::research::labels_test
