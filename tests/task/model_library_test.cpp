// The models in config/models: each is there, says where it comes from, and has the values that other code computes.
#include <Eigen/Dense>

#include "forereach/numerics/size.h"
#include "tests/paths.h"
#include "tests/task/task_files.h"

namespace forereach::model_library_test {

const std::string kDirectory = FOREREACH_SOURCE_DIR "/config/models/";

using Real = long double;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector3 = Eigen::Matrix<Real, 3, 1>;
using Matrix3 = Eigen::Matrix<Real, 3, 3>;
using Rates = std::function<Vector(const Vector& x, const Vector& u)>;

Vector Of(std::initializer_list<Real> entries) {
  Vector vector(static_cast<Eigen::Index>(entries.size()));
  std::copy(entries.begin(), entries.end(), vector.begin());
  return vector;
}

// A number of a file is the nearest double.
Real Decimal(double number) { return number; }

// The classical formula of Runge and Kutta.
Rates Rk4(double step, const Rates& f) {
  return [step, f](const Vector& x, const Vector& u) -> Vector {
    const Real h = step;
    const Vector k1 = f(x, u), k2 = f(x + h / 2 * k1, u), k3 = f(x + h / 2 * k2, u), k4 = f(x + h * k3, u);
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  };
}

Rates DoubleIntegrator(double step, Eigen::Index axes) {
  return [step, axes](const Vector& x, const Vector& u) -> Vector {
    const Real h = step;
    Vector next(2 * axes);
    next << x.head(axes) + h * x.tail(axes) + h * h / 2 * u, x.tail(axes) + h * u;
    return next;
  };
}

Vector KinematicBicycle(const Vector& x, const Vector& u) {
  const Real h = Decimal(0.1), wheelbase = 2.5L;
  return x +
         h * Of({x[3] * std::cos(x[2]), x[3] * std::sin(x[2]), x[3] * std::tan(x[5]) / wheelbase, x[4], u[0], u[1]});
}

Vector Unicycle(const Vector& x, const Vector& u) {
  return Of({x[3] * std::cos(x[2]), x[3] * std::sin(x[2]), x[4], u[0], u[1]});
}

Vector DifferentialDrive(const Vector& x, const Vector& u) {
  const Real radius = Decimal(0.033), track = Decimal(0.16);
  const Real left = radius * x[3], right = radius * x[4];  // speeds of the wheels over ground
  return Of(
      {(left + right) / 2 * std::cos(x[2]), (left + right) / 2 * std::sin(x[2]), (right - left) / track, u[0], u[1]});
}

// By the manipulator's equations, M(q) q'' = forces.
Vector CartPole(const Vector& x, const Vector& u) {
  const Real mc = 10, mp = 1, l = 0.5L, g = Decimal(9.81);
  const Real s = std::sin(x[1]), c = std::cos(x[1]);
  Matrix mass(2, 2);
  mass << mc + mp, mp * l * c, mp * l * c, mp * l * l;
  const Vector forces = Of({u[0] + mp * l * x[3] * x[3] * s, -mp * g * l * s});
  const Vector acceleration = mass.inverse() * forces;
  return Of({x[2], x[3], acceleration[0], acceleration[1]});
}

Vector PlanarQuadrotor(const Vector& x, const Vector& u) {
  const Real mass = Decimal(0.486), inertia = Decimal(0.00383), arm = 0.25L, g = Decimal(9.81);
  const Real lift = (u[0] + u[1]) / mass;
  return Of({x[3], x[4], x[5], -lift * std::sin(x[2]), lift * std::cos(x[2]) - g, arm / inertia * (u[0] - u[1])});
}

// With rotation matrices, and the rates of roll, pitch and yaw by a linear system.
Vector Quadrotor(const Vector& x, const Vector& u) {
  const Real mass = Decimal(0.775), arm = Decimal(0.15), yaw_torque = Decimal(0.0245), g = Decimal(9.81);
  const Vector3 inertia(Decimal(0.0015), Decimal(0.0025), Decimal(0.0035)), rates = x.tail(3);
  const auto about = [](int axis, Real angle) {
    return Eigen::AngleAxis<Real>(angle, Vector3::Unit(axis)).toRotationMatrix();
  };
  const Matrix3 yaw = about(2, x[5]), pitch = about(1, x[4]), roll = about(0, x[3]);
  const Vector3 acceleration = yaw * pitch * roll * Vector3(0, 0, u.sum()) / mass - Vector3(0, 0, g);
  // The body's angular velocity from the rates of the angles, in its own axes.
  Matrix3 from_angles;
  from_angles.col(0) = Vector3::UnitX();
  from_angles.col(1) = roll.transpose() * Vector3::UnitY();
  from_angles.col(2) = (pitch * roll).transpose() * Vector3::UnitZ();
  const Vector3 angles = from_angles.inverse() * rates;
  const Vector3 torque(arm * (u[1] - u[3]), arm * (u[2] - u[0]), yaw_torque * (u[0] - u[1] + u[2] - u[3]));
  const Vector3 momentum = inertia.cwiseProduct(rates);
  Vector rate(12);
  rate << x.segment(6, 3), angles, acceleration, (torque - rates.cross(momentum)).cwiseQuotient(inertia);
  return rate;
}

// M q'' + C q' = torques.
Vector TwoLinkArm(const Vector& x, const Vector& u) {
  const Real rod = Decimal(0.08333333);
  const Real alpha = 2 * rod + 0.25L + 1 + 0.25L, beta = 0.5L, delta = rod + 0.25L;
  const Real c = std::cos(x[1]), s = std::sin(x[1]);
  Matrix mass(2, 2), coriolis(2, 2);
  mass << alpha + 2 * beta * c, delta + beta * c, delta + beta * c, delta;
  coriolis << -beta * s * x[3], -beta * s * (x[2] + x[3]), beta * s * x[2], 0;
  const Vector speed = x.tail(2);
  Vector rate(4);
  rate << speed, mass.inverse() * (u - coriolis * speed);
  return rate;
}

Vector CarWithTrailer(const Vector& x, const Vector& u) {
  return Of({x[4] * std::cos(x[2]), x[4] * std::sin(x[2]), x[4] / Decimal(2.7) * std::tan(x[5]),
             x[4] / 3.5L * std::sin(x[2] - x[3]), u[0], u[1]});
}

// M nu' + C(nu) nu + D(nu) nu = tau, with the matrices of the source.
Vector Boat(const Vector& x, const Vector& tau) {
  const Real m = Decimal(23.8), iz = Decimal(1.76), xg = Decimal(0.046), smooth = Decimal(0.01);
  const Vector3 nu = x.tail(3);
  const Real u = nu[0], v = nu[1], r = nu[2];
  const Vector3 size = nu.cwiseAbs();
  const auto smoothed = [&](Real speed) { return std::sqrt(speed * speed + smooth * smooth); };
  Matrix3 rigid, added, coriolis, damping, turn;
  rigid << m, 0, 0, 0, m, m * xg, 0, m * xg, iz;
  added << 2, 0, 0, 0, 10, 0, 0, 0, 1;
  const Real c13 = -m * (xg * r + v) - 10 * v, c23 = m * u + 2 * u;
  coriolis << 0, 0, c13, 0, 0, c23, -c13, -c23, 0;
  // Of a coefficient of v or r; the absolute value of the other is smoothed.
  const auto of_v = [&](double linear, double by_v, double by_r) {
    return -(Decimal(linear) + Decimal(by_v) * size[1] + Decimal(by_r) * smoothed(r));
  };
  const auto of_r = [&](double linear, double by_v, double by_r) {
    return -(Decimal(linear) + Decimal(by_v) * smoothed(v) + Decimal(by_r) * size[2]);
  };
  damping << -(Decimal(-0.72253) + Decimal(-1.32742) * size[0] + Decimal(-5.86643) * u * u), 0, 0,  //
      0, of_v(-0.88965, -36.47287, -0.805), of_r(-7.25, -0.845, -3.45),                             //
      0, of_v(0.0313, 3.95645, 0.13), of_r(-1.9, 0.08, -0.75);
  turn = Eigen::AngleAxis<Real>(x[2], Vector3::UnitZ()).toRotationMatrix();
  const Vector3 forces = tau - coriolis * nu - damping * nu;
  Vector rate(6);
  rate << turn * nu, (rigid + added).inverse() * forces;
  return rate;
}

Vector FixedWing(const Vector& x, const Vector& u) {
  const Real mass = 13.5L, wing = Decimal(0.55), density = Decimal(1.2682), g = Decimal(9.81);
  const Real v = x[3], gamma = x[4], chi = x[5];
  const Real lift = u[1] * mass * g, force = density * v * v * wing / 2, lift_coefficient = lift / force;
  const Real drag = force * (Decimal(0.0437) + Decimal(0.02320028) * lift_coefficient * lift_coefficient);
  return Of({v * std::cos(gamma) * std::cos(chi), v * std::cos(gamma) * std::sin(chi), v * std::sin(gamma),
             (u[0] - drag) / mass - g * std::sin(gamma),
             (lift * std::cos(u[2]) - mass * g * std::cos(gamma)) / (mass * v),
             lift * std::sin(u[2]) / (mass * v * std::cos(gamma))});
}

// By the forces on the axles: F = friction stiffness (load) (slip angle).
Vector SingleTrack(const Vector& x, const Vector& u) {
  const Real mass = Decimal(1093.2952), inertia = Decimal(1791.5995), lf = Decimal(1.1561957), lr = Decimal(1.4227171),
             height = Decimal(0.57486895), g = Decimal(9.81);
  const Real gain = Decimal(1.0489) * Decimal(20.898084), delta = x[2], v = x[3], omega = x[5], beta = x[6];
  const Real front = gain * mass * (g * lr - u[1] * height) / (lf + lr) * (delta - beta - lf * omega / v);
  const Real rear = gain * mass * (g * lf + u[1] * height) / (lf + lr) * (-beta + lr * omega / v);
  return Of({v * std::cos(x[4] + beta), v * std::sin(x[4] + beta), u[0], u[1], omega,
             (lf * front - lr * rear) / inertia, (front + rear) / (mass * v) - omega});
}

struct Case {
  const char* file;
  const char* projection;
  std::size_t inputs;
  Rates next;
  std::vector<double> middle, width;  // of states and inputs, of the points that are tried
};

std::vector<Case> Cases() {
  return {
      {"kinematic_bicycle", "x, y", 2, KinematicBicycle, {0, 0, 0, 5, 0, 0, 0, 0}, {10, 10, 3, 10, 3, 0.5, 5, 1}},
      {"point_mass", "px, py", 2, DoubleIntegrator(0.15, 2), {0, 0, 0, 0, 0, 0}, {10, 10, 5, 5, 3, 3}},
      {"double_integrator_3d", "px, py, pz", 3, DoubleIntegrator(0.1, 3), std::vector<double>(9, 0),
       std::vector<double>(9, 5)},
      {"unicycle", "x, y", 2, Rk4(0.1, Unicycle), std::vector<double>(7, 0), {10, 10, 3, 2, 2, 1, 2}},
      {"differential_drive",
       "x, y",
       2,
       Rk4(0.1, DifferentialDrive),
       std::vector<double>(7, 0),
       {5, 5, 3, 6, 6, 10, 10}},
      {"cart_pole", "x", 1, Rk4(0.02, CartPole), std::vector<double>(5, 0), {2, 3, 3, 5, 50}},
      {"planar_quadrotor",
       "x, z",
       2,
       Rk4(0.05, PlanarQuadrotor),
       {0, 0, 0, 0, 0, 0, 2.4, 2.4},
       {5, 5, 1, 3, 3, 3, 2, 2}},
      {"quadrotor",
       "x, y, z",
       4,
       Rk4(0.05, Quadrotor),
       {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1.9, 1.9, 1.9, 1.9},
       {5, 5, 5, 0.6, 0.6, 3, 3, 3, 3, 2, 2, 2, 1, 1, 1, 1}},
      {"two_link_arm", "q1, q2", 2, Rk4(0.02, TwoLinkArm), std::vector<double>(6, 0), {3, 3, 4, 4, 5, 5}},
      {"car_with_trailer", "x, y", 2, Rk4(0.1, CarWithTrailer), std::vector<double>(8, 0), {9, 9, 3, 3, 8, 0.5, 2, 1}},
      {"boat", "x, y", 3, Rk4(0.1, Boat), std::vector<double>(9, 0), {5, 5, 3, 0.5, 0.2, 0.3, 2, 1, 1}},
      {"fixed_wing",
       "x, y, z",
       3,
       Rk4(0.1, FixedWing),
       {0, 0, 100, 25, 0, 0, 15, 1, 0},
       {50, 50, 50, 8, 0.3, 3, 15, 0.5, 0.6}},
      {"single_track",
       "x, y",
       2,
       Rk4(0.1, SingleTrack),
       {0, 0, 0, 15, 0, 0, 0, 0, 0},
       {9, 9, 0.1, 7, 3, 0.3, 0.05, 0.4, 3}},
  };
}

std::shared_ptr<const NominalModel> Load(const Case& one) {
  const ScratchDirectory directory;
  const std::string model = "model: {file: " + kDirectory + one.file + ".yaml}\n";
  const std::string task = TaskFor(model, one.middle.size() - one.inputs, one.inputs, one.projection);
  return LoadConfig(directory.Write("task.yaml", task), TransitionsFile::kIgnore).problem->model;
}

TEST(ModelLibrary, EachFileIsTestedHere) {
  std::vector<std::string> files, tested;
  for (const auto& entry : std::filesystem::directory_iterator(kDirectory)) files.push_back(entry.path().stem());
  for (const Case& one : Cases()) tested.emplace_back(one.file);
  EXPECT_THAT(files, testing::UnorderedElementsAreArray(tested));
}

TEST(ModelLibrary, EachFileSaysItsSourceAndUnits) {
  for (const Case& one : Cases()) {
    EXPECT_THAT(Read(kDirectory + one.file + ".yaml"), HasSubstr("\n# Source: ")) << one.file;
    const auto loaded = Load(one);
    const ModelText& model = *loaded->text();
    EXPECT_EQ(model.name, one.file);
    for (const auto& variables : {model.states, model.inputs})
      for (const ModelText::Variable& variable : variables) EXPECT_NE(variable.unit, "") << one.file << variable.name;
  }
}

TEST(ModelLibrary, TheReadmeListsEachFile) {
  const std::string text = Read(FOREREACH_SOURCE_DIR "/config/README.md");
  for (const Case& one : Cases()) {
    const auto bar = [](std::size_t count) { return std::to_string(count) + " [|]"; };
    EXPECT_THAT(text, ContainsRegex("`models/" + std::string(one.file) + ".yaml` [|] [^|]* [|] " +
                                    bar(one.middle.size() - one.inputs) + " " + bar(one.inputs)));
  }
}

TEST(ModelLibrary, EquationsAreThoseOfTheSource) {
  const unsigned seed = std::random_device()();
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const Case& one : Cases()) {
    const auto model = Load(one);
    const auto n = ToSize(model->num_states()), m = ToSize(model->num_inputs());
    ASSERT_EQ(one.width.size(), n + m) << one.file;
    for (int trial = 0; trial < 1000; ++trial) {
      std::vector<double> z(n + m), next(n);
      for (std::size_t l = 0; l < z.size(); ++l) z[l] = one.middle[l] + one.width[l] * uniform(random);
      model->Evaluate(z, next);
      const Vector point = Eigen::Map<const Eigen::VectorXd>(z.data(), static_cast<Eigen::Index>(n + m)).cast<Real>();
      const Vector expected =
          one.next(point.head(static_cast<Eigen::Index>(n)), point.tail(static_cast<Eigen::Index>(m)));
      for (std::size_t k = 0; k < n; ++k) {
        const Real value = expected[static_cast<Eigen::Index>(k)];
        ASSERT_NEAR(static_cast<double>(next[k] - value), 0, 1e-15 * (1 + static_cast<double>(std::abs(value))))
            << one.file << ", " << model->state_names()[k] << ", seed " << seed;
      }
    }
  }
}

}  // namespace forereach::model_library_test
