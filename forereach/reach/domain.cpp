#include "forereach/reach/domain.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

double LargestValue(const Domain::Inequality& inequality, std::span<const Interval> box) {
  double largest = 0;
  for (Eigen::Index l = 0; l < inequality.coefficients.size(); ++l) {
    const double c = inequality.coefficients[l];
    if (c != 0) largest = AddUp(largest, MulUp(c, c > 0 ? box[ToSize(l)].upper : box[ToSize(l)].lower));
  }
  return largest;
}

double LargestSquaredDistance(const Domain::Ball& ball, std::span<const Interval> box) {
  double largest = 0;
  for (Eigen::Index i = 0; i < ball.center.size(); ++i) {
    const double away = box[ToSize(ball.coordinates[ToSize(i)])].DistanceUpper(ball.center[i]);
    largest = AddUp(largest, MulUp(away, away));
  }
  return largest;
}

}  // namespace

void Domain::Validate(int num_states, int num_inputs) const {
  const auto require = [](bool good, const std::string& what) {
    if (!good) throw std::invalid_argument("domain: " + what);
  };
  const int variables = num_states + num_inputs;
  require(state.dim() == num_states, "state box has " + std::to_string(state.dim()) + " entries, the model " +
                                         std::to_string(num_states) + " states");
  require(input.dim() == num_inputs, "input box has " + std::to_string(input.dim()) + " entries, the model " +
                                         std::to_string(num_inputs) + " inputs");
  for (std::size_t i = 0; i < inequalities.size(); ++i) {
    const auto& [coefficients, bound] = inequalities[i];
    require(coefficients.size() == variables && coefficients.allFinite() && std::isfinite(bound),
            "inequality " + std::to_string(i) + " needs " + std::to_string(variables) +
                " finite coefficients and a finite bound");
  }
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const auto& [coordinates, center, radius] = balls[i];
    const std::string which = "ball " + std::to_string(i);
    require(!coordinates.empty() && std::ssize(coordinates) == center.size() && center.allFinite(),
            which + " needs as many finite center entries as coordinates");
    for (const int l : coordinates)
      require(0 <= l && l < variables, which + ": coordinate " + std::to_string(l) + " does not exist");
    require(radius >= 0 && radius < kInfinity, which + ": radius " + ToText(radius) + " is negative or not finite");
  }
}

std::vector<Interval> Domain::Ranges() const {
  std::vector<Interval> ranges;
  for (const Box* part : {&state, &input})
    for (int l = 0; l < part->dim(); ++l) ranges.emplace_back(part->lower()[l], part->upper()[l]);
  return ranges;
}

std::pair<std::vector<double>, std::vector<double>> Domain::Corners() const {
  std::pair<std::vector<double>, std::vector<double>> corners;
  for (const Interval& range : Ranges()) {
    corners.first.push_back(range.lower);
    corners.second.push_back(range.upper);
  }
  return corners;
}

bool Domain::Contains(std::span<const double> z) const noexcept {
  std::array<Interval, kMaxVariables> point;
  for (std::size_t l = 0; l < z.size(); ++l) point[l] = Interval(z[l]);
  return FindExit(*this, {point.data(), z.size()}).kind == DomainExit::Kind::kNone;
}

DomainTest::DomainTest(const Domain& domain, const Eigen::VectorXd& input_error)
    : domain_(domain),
      num_states_(ToSize(domain.state.dim())),
      size_(num_states_ + ToSize(domain.input.dim())),
      is_box_(domain.inequalities.empty() && domain.balls.empty()) {
  std::ranges::copy(domain.state.lower(), state_lower_.begin());
  std::ranges::copy(domain.state.upper(), state_upper_.begin());
  std::ranges::copy(domain.input.lower(), input_lower_.begin());
  std::ranges::copy(domain.input.upper(), input_upper_.begin());
  std::ranges::copy(input_error, input_error_.begin());
  for (std::size_t l = 0; l < ToSize(domain.input.dim()); ++l) {
    if (input_error_[l] == 0) continue;
    input_lower_[l] = AddUp(input_lower_[l], input_error_[l]);
    input_upper_[l] = SubDown(input_upper_[l], input_error_[l]);
  }
}

// Whether inequalities and balls hold by more than the rounding of plain arithmetic; false leaves it open. d_z entries
// each. docs/soundness.md, 2 and 3.2.
bool DomainTest::MeetsConstraintsWell(const double* center, const double* half_width) const noexcept {
  bool inside = true;
  for (const auto& [coefficients, bound] : domain_.inequalities) {
    double value = 0, size = std::abs(bound) + 0x1p-1000;
    for (Eigen::Index l = 0; l < coefficients.size(); ++l) {
      const double c = coefficients[l];
      value += c * center[l] + std::abs(c) * half_width[l];
      size += std::abs(c) * (std::abs(center[l]) + half_width[l]);
    }
    inside &= value + RoundingError(kMargin, size) < bound;
  }
  for (const auto& [coordinates, ball_center, radius] : domain_.balls) {
    double square = 0;
    for (Eigen::Index i = 0; i < ball_center.size(); ++i) {
      const int l = coordinates[ToSize(i)];
      const double middle = ball_center[i];
      const double reach =
          std::abs(center[l] - middle) + half_width[l] + RoundingError(kMargin, std::abs(center[l]) + std::abs(middle));
      square += reach * reach;
    }
    inside &= radius > 0x1p-400 && square * (1 + kMargin) < radius * radius * (1 - kMargin);
  }
  return inside;
}

DomainExit DomainTest::FindExitOf(const double* center, const double* half_width, std::span<const double> input,
                                  bool inside_box) const noexcept {
  std::array<double, kMaxVariables> middle, reach;
  for (std::size_t k = 0; k < num_states_; k += kLaneCount) {
    StoreLanes(LoadLanes(center + k), &middle[k]);
    StoreLanes(LoadLanes(half_width + k), &reach[k]);
  }
  for (std::size_t l = 0; l < input.size(); ++l) {
    middle[num_states_ + l] = input[l];
    reach[num_states_ + l] = input_error_[l];
  }
  if (inside_box && MeetsConstraintsWell(middle.data(), reach.data())) return {};
  std::array<Interval, kMaxVariables> box;
  for (std::size_t l = 0; l < size_; ++l) box[l] = {SubDown(middle[l], reach[l]), AddUp(middle[l], reach[l])};
  return forereach::FindExit(domain_, {box.data(), size_});
}

DomainExit FindExit(const Domain& domain, std::span<const Interval> box) noexcept {
  using Kind = DomainExit::Kind;
  const int n = domain.state.dim();
  for (int l = 0; l < static_cast<int>(box.size()); ++l) {
    const Interval& z = box[ToSize(l)];
    const Box& side = l < n ? domain.state : domain.input;
    const double lower = side.lower()[l < n ? l : l - n], upper = side.upper()[l < n ? l : l - n];
    if (!(lower <= z.lower)) return {Kind::kLower, l, z.lower, lower};
    if (!(z.upper <= upper)) return {Kind::kUpper, l, z.upper, upper};
  }
  for (std::size_t i = 0; i < domain.inequalities.size(); ++i) {
    const double value = LargestValue(domain.inequalities[i], box), bound = domain.inequalities[i].bound;
    if (!(value <= bound)) return {Kind::kInequality, static_cast<int>(i), value, bound};
  }
  for (std::size_t i = 0; i < domain.balls.size(); ++i) {
    const double square = LargestSquaredDistance(domain.balls[i], box), radius = domain.balls[i].radius;
    if (!(square <= MulDown(radius, radius))) return {Kind::kBall, static_cast<int>(i), SqrtUp(square), radius};
  }
  return {};
}

}  // namespace forereach
