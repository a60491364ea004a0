#include "research/drift/single_track_drift.h"

#include <algorithm>
#include <cmath>

namespace forereach::research {
namespace {

// ---- parameters of vehicle 2, in the units of the program that they are from, which are feet and pounds

constexpr double kFoot = 0.3048;                     // m
constexpr double kPound = 4.4482216152605;           // N
constexpr double kMass = 74.91452 * kPound / kFoot;  // kg
constexpr double kInertia = 1321.416 * kPound * kFoot;
constexpr double kFront = 3.793293 * kFoot, kRear = 4.667707 * kFoot, kBase = kFront + kRear;
constexpr double kHeight = 2.01355 * kFoot;  // of the sprung mass's center of gravity
constexpr double kWheelInertia = 1.7;        // kg m^2
constexpr double kBrakeSplit = 0.66, kEngineSplit = 0;
constexpr double kMostSteering = 1.066, kMostSteeringRate = 0.4;
constexpr double kLowestSpeed = -13.6, kHighestSpeed = 50.8, kSwitchSpeed = 7.319, kMostAcceleration = 11.5;
constexpr double kGravity = 9.81;

// Where the kinematic model takes over: at kMixSpeed by half, within some kMixWidth.
constexpr double kMixSpeed = 0.2, kMixWidth = 0.05, kSlowest = kMixSpeed / 2;
constexpr double kSettling = 0.02;  // s, in which its wheels come to roll

// ---- tyres, without camber

double Magic(double stiffness, double curvature, double slip) {
  const double scaled = stiffness * slip;
  return std::atan(scaled - curvature * (scaled - std::atan(scaled)));
}

// A force under combined slip: the pure one's share is 1 without the other slip.
double Share(double stiffness, double shape, double curvature, double slip, double shift) {
  return std::cos(shape * Magic(stiffness, curvature, slip + shift)) /
         std::cos(shape * Magic(stiffness, curvature, shift));
}

double AlongTyre(double slip, double angle, double load) {
  constexpr double kShape = 1.6411, kFriction = 1.1739, kCurvature = 0.46403, kStiffness = 22.303, kShift = 0.0012297,
                   kLift = -8.8098e-6;
  // The lift stands inside the sine, as in the published program.
  const double pure =
      kFriction * load *
      std::sin(kShape * Magic(kStiffness / (kShape * kFriction), kCurvature, kShift - slip) + load * kLift);
  const double stiffness = 13.276 * std::cos(std::atan(-13.778 * slip));
  return pure * Share(stiffness, 1.2568, 0.65225, angle, 0.0050722);
}

double AcrossTyre(double slip, double angle, double load) {
  constexpr double kShape = 1.3507, kFriction = 1.0489, kCurvature = -0.0074722, kStiffness = -21.92;
  const double pure = kFriction * load * std::sin(kShape * Magic(kStiffness / (kShape * kFriction), kCurvature, angle));
  const double stiffness = 7.1433 * std::cos(std::atan(9.1916 * (angle + 0.027856)));
  const double induced =
      kFriction * load * -0.027825 * std::cos(std::atan(12.12 * angle)) * std::sin(1.9 * std::atan(-10.704 * slip));
  return pure * Share(stiffness, 1.0719, -0.27572, slip, 5.7448e-6) + induced;
}

// ---- limits of the input

double LimitSteering(double delta, double rate) {
  if ((delta <= -kMostSteering && rate <= 0) || (delta >= kMostSteering && rate >= 0)) return 0;
  return std::clamp(rate, -kMostSteeringRate, kMostSteeringRate);
}

double LimitAcceleration(double v, double a) {
  if ((v <= kLowestSpeed && a <= 0) || (v >= kHighestSpeed && a >= 0)) return 0;
  const double most = v > kSwitchSpeed ? kMostAcceleration * kSwitchSpeed / v : kMostAcceleration;
  return std::clamp(a, -kMostAcceleration, most);
}

// Speed, yaw rate, slip angle and wheels: what the two models that are mixed differ in.
struct Changes {
  double v, psi, omega, beta, front, rear;
};

// Along each wheel's plane, m/s; never backward.
struct WheelSpeeds {
  double front, rear;
};

WheelSpeeds WheelSpeedsOf(const DriftState& x) {
  const double along = x[kSpeed] * std::cos(x[kBeta]);
  const double across = x[kSpeed] * std::sin(x[kBeta]) + kFront * x[kOmega];
  return {std::max(0.0, along * std::cos(x[kDelta]) + across * std::sin(x[kDelta])), std::max(0.0, along)};
}

Changes Dynamic(const DriftState& x, double a) {
  const double v = x[kSpeed], delta = x[kDelta], omega = x[kOmega], beta = x[kBeta];
  const bool moving = v > kSlowest;
  const auto angle = [&](double lever) {
    return moving ? std::atan((v * std::sin(beta) + lever * omega) / (v * std::cos(beta))) : 0;
  };
  const double angle_front = moving ? angle(kFront) - delta : 0, angle_rear = angle(-kRear);
  const double load_front = kMass * (kGravity * kRear - a * kHeight) / kBase,
               load_rear = kMass * (kGravity * kFront + a * kHeight) / kBase;
  const WheelSpeeds speeds = WheelSpeedsOf(x);
  const double slip_front = 1 - kWheelRadius * x[kFrontWheel] / std::max(speeds.front, kSlowest),
               slip_rear = 1 - kWheelRadius * x[kRearWheel] / std::max(speeds.rear, kSlowest);
  const double along_front = AlongTyre(slip_front, angle_front, load_front),
               along_rear = AlongTyre(slip_rear, angle_rear, load_rear),
               across_front = AcrossTyre(slip_front, angle_front, load_front),
               across_rear = AcrossTyre(slip_rear, angle_rear, load_rear);

  const double split = a > 0 ? kEngineSplit : kBrakeSplit, torque = kMass * kWheelRadius * a;
  const double to_front = delta - beta;
  Changes changes{};
  changes.v = (along_front * std::cos(to_front) - across_front * std::sin(to_front) + along_rear * std::cos(beta) +
               across_rear * std::sin(beta)) /
              kMass;
  changes.psi = omega;
  changes.omega =
      (kFront * (across_front * std::cos(delta) + along_front * std::sin(delta)) - kRear * across_rear) / kInertia;
  if (moving)
    changes.beta = (across_front * std::cos(to_front) + along_front * std::sin(to_front) +
                    across_rear * std::cos(beta) - along_rear * std::sin(beta)) /
                       (kMass * v) -
                   omega;
  if (x[kFrontWheel] >= 0) changes.front = (split * torque - kWheelRadius * along_front) / kWheelInertia;
  if (x[kRearWheel] >= 0) changes.rear = ((1 - split) * torque - kWheelRadius * along_rear) / kWheelInertia;
  return changes;
}

Changes Kinematic(const DriftState& x, double steer_rate, double a) {
  const double v = x[kSpeed], beta = x[kBeta], tangent = std::tan(x[kDelta]);
  const double cosine = std::cos(x[kDelta]), spread = tangent * tangent * kRear / kBase;
  const WheelSpeeds speeds = WheelSpeedsOf(x);
  Changes changes{};
  changes.v = a;
  changes.psi = v * std::cos(std::atan(tangent * kRear / kBase)) * tangent / kBase;
  changes.beta = kRear * steer_rate / (kBase * cosine * cosine * (1 + spread * spread));
  changes.omega = (a * std::cos(beta) * tangent - v * std::sin(beta) * changes.beta * tangent +
                   v * std::cos(beta) * steer_rate / (cosine * cosine)) /
                  kBase;
  changes.front = (speeds.front / kWheelRadius - std::max(0.0, x[kFrontWheel])) / kSettling;
  changes.rear = (speeds.rear / kWheelRadius - std::max(0.0, x[kRearWheel])) / kSettling;
  return changes;
}

}  // namespace

DriftState Rolling(double speed, double delta) {
  DriftState state = DriftState::Zero();
  state[kDelta] = delta;
  state[kSpeed] = speed;
  state[kFrontWheel] = speed * std::cos(delta) / kWheelRadius;
  state[kRearWheel] = speed / kWheelRadius;
  return state;
}

DriftState DriftRate(const DriftState& x, const DriftInput& input) {
  const double steer_rate = LimitSteering(x[kDelta], input[0]), a = LimitAcceleration(x[kSpeed], input[1]);
  const Changes dynamic = Dynamic(x, a), kinematic = Kinematic(x, steer_rate, a);
  const double weight = 0.5 * (std::tanh((x[kSpeed] - kMixSpeed) / kMixWidth) + 1);
  const auto mix = [&](double Changes::*of) { return weight * dynamic.*of + (1 - weight) * kinematic.*of; };
  DriftState rate;
  rate << x[kSpeed] * std::cos(x[kBeta] + x[kPsi]), x[kSpeed] * std::sin(x[kBeta] + x[kPsi]), steer_rate,
      mix(&Changes::v), mix(&Changes::psi), mix(&Changes::omega), mix(&Changes::beta), mix(&Changes::front),
      mix(&Changes::rear);
  return rate;
}

DriftState Drift(DriftState state, const DriftInput& input, double dt, int steps) {
  const double h = dt / steps;
  for (int i = 0; i < steps; ++i) {
    const DriftState first = DriftRate(state, input), second = DriftRate(state + h / 2 * first, input),
                     third = DriftRate(state + h / 2 * second, input), fourth = DriftRate(state + h * third, input);
    state += h / 6 * (first + 2 * second + 2 * third + fourth);
  }
  return state;
}

}  // namespace forereach::research
