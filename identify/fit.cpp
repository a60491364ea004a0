#include "identify/fit.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>

#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

constexpr int kMostEvaluations = 2000;
constexpr double kDifference = 1e-12;  // the square of the relative step of a difference
constexpr double kStep = 6e-6;         // of central differences: the cube root of a rounding
constexpr double kScaleUnits = 16;     // units in the last place of x+: no error or change counts as less
constexpr double kDependence = 1e-8;   // columns that depend on each other up to this much are dependent
constexpr double kShare = 1e-4;        // of a parameter in an undetermined direction: less is rounding

// x+ - f0(z) of all transitions, N-by-n; of an angle without whole turns.
Eigen::MatrixXd ErrorsOf(const ModelText& text, const Transitions& transitions) {
  const auto model = MakeTextModel(text);
  Eigen::MatrixXd errors(transitions.x_next.rows(), transitions.x_next.cols());
  Eigen::VectorXd z, next(errors.cols());
  for (Eigen::Index i = 0; i < errors.rows(); ++i) {
    z = transitions.z.row(i);
    model->Evaluate({z.data(), ToSize(z.size())}, {next.data(), ToSize(next.size())});
    errors.row(i) = transitions.x_next.row(i) - next.transpose();
    for (const int k : model->angles()) errors(i, k) = std::remainder(errors(i, k), 2 * std::numbers::pi);
  }
  return errors;
}

// What the solver minimises: the scaled errors as a function of the parameters, each divided by its unit.
class Residuals {
 public:
  using Scalar = double;
  using InputType = Eigen::VectorXd;
  using ValueType = Eigen::VectorXd;
  using JacobianType = Eigen::MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  Residuals(const ModelText& text, const Transitions& transitions, std::vector<std::size_t> free)
      : text_(text), transitions_(transitions), free_(std::move(free)) {
    const Eigen::MatrixXd errors = ErrorsOf(text, transitions);
    if (!errors.allFinite()) throw std::invalid_argument("the model has no finite value at some transition");
    scales_ = (errors.colwise().squaredNorm() / static_cast<double>(errors.rows())).cwiseSqrt();
    scales_ = scales_.cwiseMax(kScaleUnits * RoundingOf(transitions));
    for (double& scale : scales_)
      if (!(scale > 0)) scale = 1;
    rounding_ = RoundingOf(transitions).cwiseQuotient(scales_);
    for (const std::size_t p : free_)
      units_.push_back(text.parameters[p].lower == 0 ? 1 : std::abs(text.parameters[p].lower));
  }

  [[nodiscard]] int inputs() const { return static_cast<int>(free_.size()); }
  [[nodiscard]] int values() const { return static_cast<int>(transitions_.x_next.size()); }

  // Parameters without a finite value are far from every solution: the solver then takes a shorter step.
  int operator()(const Eigen::VectorXd& x, Eigen::VectorXd& values) const {
    static_cast<void>(Scaled(x, values));
    for (double& value : values)
      if (!std::isfinite(value)) value = 1e10;
    return 0;
  }

  [[nodiscard]] ModelText TextWith(const Eigen::VectorXd& x) const {
    ModelText text = text_;
    for (std::size_t c = 0; c < free_.size(); ++c) {
      ModelText::Parameter& parameter = text.parameters[free_[c]];
      parameter.lower = parameter.upper = x[static_cast<Eigen::Index>(c)] * units_[c];
    }
    return text;
  }
  [[nodiscard]] Eigen::MatrixXd Errors(const Eigen::VectorXd& x) const { return ErrorsOf(TextWith(x), transitions_); }
  [[nodiscard]] Eigen::VectorXd Start() const {
    Eigen::VectorXd x(inputs());
    for (std::size_t c = 0; c < free_.size(); ++c)
      x[static_cast<Eigen::Index>(c)] = text_.parameters[free_[c]].lower / units_[c];
    return x;
  }
  [[nodiscard]] double unit(std::size_t c) const { return units_[c]; }

  // How fast the scaled errors change with parameter c over steps of this size from x, to the side or sides that have a
  // value. What rounding may do to each of them is taken off, so that zero means that nothing is seen.
  [[nodiscard]] double Slope(const Eigen::VectorXd& x, Eigen::Index c, double step) const {
    const Eigen::VectorXd by = step * Eigen::VectorXd::Unit(x.size(), c);
    Eigen::VectorXd here(values()), side(values());
    double slope = 0;
    if (!Scaled(x, here)) return slope;
    for (const double sign : {-1.0, 1.0})
      if (Scaled(x + sign * by, side)) {
        Eigen::ArrayXXd change = (side - here).cwiseAbs().reshaped(transitions_.x_next.rows(), rounding_.size());
        change.rowwise() -= kScaleUnits * rounding_.array();
        slope = std::max(slope, change.cwiseMax(0).matrix().norm() / step);
      }
    return slope;
  }
  // The sum of squares that the solver minimises; infinite where the model has no value.
  [[nodiscard]] double Cost(const Eigen::VectorXd& x) const {
    Eigen::VectorXd values(this->values());
    return Scaled(x, values) ? values.squaredNorm() : kInfinity;
  }

  // The scaled errors by the parameters at x: central differences, and how far rounding may move each column.
  struct Derivatives {
    Eigen::MatrixXd columns;
    Eigen::RowVectorXd noise;
  };
  [[nodiscard]] Derivatives DerivativesAt(const Eigen::VectorXd& x) const {
    Derivatives found{Eigen::MatrixXd(values(), inputs()), Eigen::RowVectorXd::Zero(inputs())};
    const auto rows = static_cast<Eigen::Index>(transitions_.x_next.rows());
    Eigen::VectorXd above(values()), below(values());
    for (Eigen::Index c = 0; c < x.size(); ++c) {
      const double step = kStep * std::max(std::abs(x[c]), 1.0);
      const Eigen::VectorXd by = step * Eigen::VectorXd::Unit(x.size(), c);
      const bool has_above = Scaled(x + by, above), has_below = Scaled(x - by, below);
      if (!has_above) static_cast<void>(Scaled(x, above));
      if (!has_below) static_cast<void>(Scaled(x, below));
      found.columns.col(c) = (above - below) / (has_above && has_below ? 2 * step : step);
      for (Eigen::Index k = 0; k < rounding_.size(); ++k) {
        const auto touched = (found.columns.col(c).segment(k * rows, rows).array() != 0).count();
        const double each = rounding_[k] / step;
        found.noise[c] += each * each * static_cast<double>(touched);
      }
    }
    found.noise = found.noise.cwiseSqrt();
    return found;
  }

 private:
  // The scaled errors. False if the model has no value at some transition.
  bool Scaled(const Eigen::VectorXd& x, Eigen::VectorXd& values) const {
    Eigen::MatrixXd errors = Errors(x);
    errors.array().rowwise() /= scales_.array();
    values = errors.reshaped();
    return values.allFinite();
  }

  // About a unit in the last place of each state's largest value.
  static Eigen::RowVectorXd RoundingOf(const Transitions& transitions) {
    return std::numeric_limits<double>::epsilon() * transitions.x_next.cwiseAbs().colwise().maxCoeff();
  }

  ModelText text_;  // parameters have one value each
  const Transitions& transitions_;
  std::vector<std::size_t> free_;
  std::vector<double> units_;
  Eigen::RowVectorXd scales_;
  Eigen::RowVectorXd rounding_;  // of an error over its scale
};

double SizeAt(const Eigen::VectorXd& x, Eigen::Index c) { return std::max(std::abs(x[c]), 1.0); }

// A derivative is infinite if the slopes grow whenever a step is a thousandth.
bool HasDerivative(const Residuals& problem, const Eigen::VectorXd& x, Eigen::Index c) {
  const double step = kStep * SizeAt(x, c), slope = problem.Slope(x, c, 1e-3 * step);
  return !(slope > 1.25 * problem.Slope(x, c, step) && problem.Slope(x, c, 1e-6 * step) > 1.25 * slope);
}

// Whether larger changes of a parameter move the errors.
bool HasEffectElsewhere(const Residuals& problem, const Eigen::VectorXd& x, Eigen::Index c) {
  return std::ranges::any_of(std::initializer_list<double>{1e-2, 1},
                             [&](double share) { return problem.Slope(x, c, share * SizeAt(x, c)) > 0; });
}

// A parameter runs away if it moved by more than its size, and ten, a hundred and a thousand times as far is no worse.
bool RunsAway(const Residuals& problem, const Eigen::VectorXd& x, const Eigen::VectorXd& move) {
  if (!x.allFinite()) return true;
  const double most = problem.Cost(x) * (1 + 1e-9);
  return std::ranges::all_of(std::initializer_list<double>{9, 99, 999},
                             [&](double times) { return problem.Cost(x + times * move) <= most; });
}

[[noreturn]] void RefuseDerivative(const std::string& what, double value) {
  throw std::invalid_argument(fmt::format("{} {:.6g}; begin elsewhere", what, value));
}

void RequireDerivatives(const Residuals& problem, const Eigen::VectorXd& x, const std::vector<std::string>& names) {
  for (Eigen::Index c = 0; c < x.size(); ++c)
    if (!HasDerivative(problem, x, c))
      RefuseDerivative(fmt::format("the model has no derivative by '{}' at", names[ToSize(c)]),
                       x[c] * problem.unit(ToSize(c)));
}

// The solver never moves a parameter that begins where its derivative is zero.
void RequireEffects(const Residuals& problem, const Eigen::VectorXd& x, const std::vector<std::string>& names) {
  const Residuals::Derivatives derivatives = problem.DerivativesAt(x);
  for (Eigen::Index c = 0; c < x.size(); ++c)
    if (derivatives.columns.col(c).norm() <= 2 * derivatives.noise[c] && HasEffectElsewhere(problem, x, c))
      RefuseDerivative(fmt::format("'{}' has no effect near", names[ToSize(c)]), x[c] * problem.unit(ToSize(c)));
}

void RefuseRunaways(const Residuals& problem, const Eigen::VectorXd& x, const std::vector<std::string>& names) {
  const Eigen::VectorXd start = problem.Start();
  Eigen::VectorXd far = Eigen::VectorXd::Zero(x.size());
  std::string all;
  for (Eigen::Index c = 0; c < x.size(); ++c) {
    if (std::abs(x[c] - start[c]) <= SizeAt(start, c)) continue;
    far[c] = x[c] - start[c];
    all += (all.empty() ? "'" : ", '") + names[ToSize(c)] + "'";
    if (RunsAway(problem, x, far[c] * Eigen::VectorXd::Unit(x.size(), c))) {
      far = Eigen::VectorXd::Unit(x.size(), c) * far[c];
      all = "'" + names[ToSize(c)] + "'";
      break;
    }
  }
  if (!all.empty() && RunsAway(problem, x, far))
    throw std::invalid_argument(fmt::format(
        "the transitions do not bound {}: the fit gets no worse the farther it goes; begin elsewhere, or leave it out",
        all));
}

// What the derivatives at the solution say of the parameters.
struct Determined {
  Eigen::VectorXd deviations;    // standard errors, infinite if not determined, NaN if nothing shows the noise
  Eigen::MatrixXd undetermined;  // the projector onto the directions that the errors do not depend on
};

// The standard errors by the header's formula. G is J (J^T J)^-1 without the undetermined directions, `leverages` the
// diagonal of H.
Eigen::VectorXd DeviationsOf(const Eigen::MatrixXd& G, const Eigen::VectorXd& leverages, const Eigen::VectorXd& values,
                             Eigen::Index states) {
  const Eigen::Index rows = values.size() / states;
  const Eigen::RowVectorXd lengths = G.colwise().norm();
  Eigen::VectorXd variances = Eigen::VectorXd::Zero(G.cols());
  for (Eigen::Index k = 0; k < states; ++k) {
    // Degrees of freedom of this state's errors. Without one, nothing shows how large they are.
    const double left = static_cast<double>(rows) - leverages.segment(k * rows, rows).sum();
    const double variance = left > 1 - kShare ? values.segment(k * rows, rows).squaredNorm() / left
                                              : std::numeric_limits<double>::quiet_NaN();
    for (Eigen::Index c = 0; c < G.cols(); ++c)
      // A state that says nothing of the parameter adds nothing, even if its own noise is unknown.
      if (const double length = G.col(c).segment(k * rows, rows).norm(); length > kShare * lengths[c])
        variances[c] += variance * length * length;
  }
  return variances.cwiseSqrt();
}

// The columns are scaled to length 1. A direction v is undetermined if the errors change along it by no more than
// rounding does: a parameter is undetermined if such a direction has a share of it.
Determined Determine(const Residuals::Derivatives& derivatives, const Eigen::VectorXd& values, Eigen::Index states) {
  const Eigen::Index count = derivatives.columns.cols();
  Eigen::RowVectorXd norms = derivatives.columns.colwise().norm();
  Eigen::VectorXd noise(count);
  for (Eigen::Index c = 0; c < count; ++c) {
    noise[c] = norms[c] > 0 ? derivatives.noise[c] / norms[c] : 1;
    if (!(norms[c] > 0)) norms[c] = 1;
  }
  const Eigen::MatrixXd scaled = derivatives.columns.array().rowwise() / norms.array();
  const Eigen::MatrixXd triangle =
      Eigen::HouseholderQR<Eigen::MatrixXd>(scaled).matrixQR().topRows(count).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle, Eigen::ComputeFullV);
  Determined found{{}, Eigen::MatrixXd::Zero(count, count)};
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(values.size(), count);
  Eigen::VectorXd leverages = Eigen::VectorXd::Zero(values.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::VectorXd direction = svd.matrixV().col(i);
    const double length = svd.singularValues()[i];
    if (length <= std::max(kDependence, 2 * direction.cwiseProduct(noise).norm())) {
      found.undetermined += direction * direction.transpose();
      continue;
    }
    const Eigen::VectorXd unit = scaled * direction / length;
    G += unit * direction.transpose() / length;
    leverages += unit.cwiseAbs2();
  }
  found.deviations = DeviationsOf(G, leverages, values, states).cwiseQuotient(norms.transpose());
  for (Eigen::Index c = 0; c < count; ++c)
    if (found.undetermined(c, c) > kShare * kShare) found.deviations[c] = kInfinity;
  return found;
}

// The other parameters of which only a combination with this one is determined.
std::vector<std::string> TogetherWith(Eigen::Index c, const Determined& determined,
                                      const std::vector<std::string>& names) {
  std::vector<std::string> others;
  if (determined.deviations[c] != kInfinity) return others;
  for (Eigen::Index other = 0; other < determined.undetermined.cols(); ++other)
    if (other != c && std::abs(determined.undetermined(c, other)) > kShare) others.push_back(names[ToSize(other)]);
  return others;
}

// The places of the named parameters in the text.
std::vector<std::size_t> PlacesOf(const ModelText& text, const std::vector<std::string>& names) {
  std::vector<std::size_t> places;
  for (const std::string& name : names) {
    const auto at = std::ranges::find(text.parameters, name, &ModelText::Parameter::name);
    if (at == text.parameters.end()) throw std::invalid_argument(fmt::format("the model has no parameter '{}'", name));
    if (name == "dt") throw std::invalid_argument("dt is the step, which no transition says");
    const auto place = ToSize(at - text.parameters.begin());
    if (std::ranges::find(places, place) != places.end())
      throw std::invalid_argument(fmt::format("parameter '{}' is given twice", name));
    places.push_back(place);
  }
  if (places.empty()) throw std::invalid_argument("no parameter to fit");
  return places;
}

}  // namespace

Fit FitParameters(const ModelText& text, const Transitions& transitions, const std::vector<std::string>& names) {
  const std::vector<std::size_t> places = PlacesOf(text, names);
  if (transitions.x_next.size() < std::ssize(names))
    throw std::invalid_argument(
        fmt::format("{} numbers cannot determine {} parameters", transitions.x_next.size(), names.size()));
  ModelText middle = text;
  for (ModelText::Parameter& parameter : middle.parameters)
    parameter.lower = parameter.upper = parameter.lower + (parameter.upper - parameter.lower) / 2;
  const Residuals problem(middle, transitions, places);
  Eigen::NumericalDiff<Residuals, Eigen::Central> differences(problem, kDifference);
  Eigen::LevenbergMarquardt<Eigen::NumericalDiff<Residuals, Eigen::Central>> solver(differences);
  solver.parameters.maxfev = kMostEvaluations;
  solver.parameters.xtol = solver.parameters.ftol = 1e-12;
  Eigen::VectorXd x = problem.Start();
  RequireDerivatives(problem, x, names);
  RequireEffects(problem, x, names);
  const auto status = solver.minimize(x);
  RefuseRunaways(problem, x, names);
  RequireDerivatives(problem, x, names);

  Fit fit;
  fit.converged = status != Eigen::LevenbergMarquardtSpace::TooManyFunctionEvaluation &&
                  status != Eigen::LevenbergMarquardtSpace::ImproperInputParameters;
  fit.evaluations = static_cast<int>(solver.nfev + 2 * std::ssize(names) * solver.njev);
  fit.before = problem.Errors(problem.Start());
  fit.after = problem.Errors(x);
  Eigen::VectorXd values;
  (void)problem(x, values);
  const Determined determined = Determine(problem.DerivativesAt(x), values, fit.after.cols());
  for (std::size_t c = 0; c < places.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(c);
    fit.parameters.push_back({names[c], middle.parameters[places[c]].lower, x[at] * problem.unit(c),
                              determined.deviations[at] * problem.unit(c), TogetherWith(at, determined, names),
                              HasEffectElsewhere(problem, x, at)});
  }
  return fit;
}

}  // namespace forereach
