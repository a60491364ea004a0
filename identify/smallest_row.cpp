#include "identify/smallest_row.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <ClpSimplex.hpp>

#include "forereach/numerics/size.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/lipschitz_row.h"
#include "forereach/residual/observation_index.h"
#include "forereach/residual/pairs.h"
#include "identify/noise_floor.h"

namespace forereach {
namespace {

// Few at a time: the next row satisfies most of the others, too.
constexpr std::size_t kCutsInARound = 60;
constexpr int kMostRounds = 500;
constexpr double kTolerance = 1e-9;  // of the program, whose numbers are made to be about 1

// The program: minimise sum_c p_c y_c over y >= 0 with A y >= b, where y_c = s_l L_kl for the free columns l, and e for
// the last one if there is a scatter.
class LinearProgram {
 public:
  explicit LinearProgram(const std::vector<double>& prices) : columns_(prices.size()) {
    clp_.setLogLevel(0);
    clp_.resize(0, static_cast<int>(columns_));
    clp_.setPrimalTolerance(kTolerance);
    for (std::size_t c = 0; c < columns_; ++c) {
      clp_.setColumnBounds(static_cast<int>(c), 0, COIN_DBL_MAX);
      clp_.setObjectiveCoefficient(static_cast<int>(c), prices[c]);
    }
  }

  void Add(const std::vector<double>& coefficients, double bound) {
    std::vector<int> indices(columns_);
    for (std::size_t c = 0; c < columns_; ++c) indices[c] = static_cast<int>(c);
    clp_.addRow(static_cast<int>(columns_), indices.data(), coefficients.data(), bound, COIN_DBL_MAX);
  }

  // The minimum, or false if there is no solution.
  bool Solve() {
    clp_.dual();
    return clp_.isProvenOptimal();
  }
  [[nodiscard]] double Value(std::size_t c) const { return std::max(0.0, clp_.primalColumnSolution()[c]); }
  [[nodiscard]] double Price(std::size_t row) const { return clp_.dualRowSolution()[row]; }

 private:
  const std::size_t columns_;
  ClpSimplex clp_;
};

class SmallestRowSearch {
 public:
  SmallestRowSearch(const Declaration& declaration, const Observations& observations, int coordinate,
                    const Eigen::RowVectorXd& scales)
      : declaration_(declaration), observations_(observations), k_(coordinate), scales_(scales) {
    for (Eigen::Index l = 0; l < scales.size(); ++l)
      if (scales[l] > 0) {
        free_.push_back(l);
        declaration_.lipschitz(k_, l) = 0;
      }
    entries_ = Entries();
    const auto [highest, lowest] = Extremes();
    unit_ = entries_.floors[highest] - entries_.ceilings[lowest];
  }

  SmallestRow Run() {
    SmallestRow found;
    found.slopes = declaration_.lipschitz.row(k_);
    found.reasons.resize(ToSize(scales_.size()));
    LinearProgram program(std::vector<double>(free_.size(), 1));
    Solve(program, found);
    if (found.unexplained) return found;
    if (!cuts_.empty()) FindReasons(program, found);
    ScaleUp();
    found.slopes = declaration_.lipschitz.row(k_);
    return found;
  }

  double Scatter() {
    has_scatter_ = true;
    const double declared = declaration_.DisturbanceBound(k_);
    if (declaration_.disturbance.size() == 0)
      declaration_.disturbance = Eigen::VectorXd::Zero(declaration_.noise_bound.size());
    std::vector<double> prices(free_.size(), 1);
    prices.push_back(2 / kNearby);
    LinearProgram program(prices);
    SmallestRow found;
    Solve(program, found);
    const double scatter = declaration_.disturbance[k_] - declared;
    return scatter > 2 * kTolerance * std::max(unit_, 0.0) ? scatter + kTolerance * unit_ : 0;
  }

 private:
  // Adds cuts until no pair violates the row.
  void Solve(LinearProgram& program, SmallestRow& found) {
    const double declared = declaration_.DisturbanceBound(k_);
    for (; found.rounds < kMostRounds; ++found.rounds) {
      const std::vector<ObservedPair> violated = MostViolated();
      if (violated.empty()) break;
      for (const ObservedPair& pair : violated) {
        const std::vector<double> coefficients = CoefficientsOf(pair);
        // Two that agree in all free columns: no slope explains that they differ.
        if (std::ranges::all_of(coefficients, [](double value) { return value == 0; })) {
          found.unexplained = pair;
          return;
        }
        program.Add(coefficients, FreePart(pair) / unit_);
        cuts_.push_back(pair);
      }
      if (!program.Solve()) break;  // cannot happen: a large enough row satisfies every cut
      for (std::size_t c = 0; c < free_.size(); ++c)
        declaration_.lipschitz(k_, free_[c]) = program.Value(c) * unit_ / scales_[free_[c]];
      if (has_scatter_) declaration_.disturbance[k_] = declared + program.Value(free_.size()) * unit_;
    }
  }

  [[nodiscard]] ObservationIndex::Entries Entries() const {
    return EntriesOf(LipschitzRow(declaration_, k_), declaration_, observations_, k_);
  }
  [[nodiscard]] double Along(const ObservedPair& pair, Eigen::Index l) const {
    return std::abs(observations_.z(pair.first, l) - observations_.z(pair.second, l));
  }
  [[nodiscard]] std::vector<double> CoefficientsOf(const ObservedPair& pair) const {
    std::vector<double> coefficients;
    for (const Eigen::Index l : free_) coefficients.push_back(Along(pair, l) / scales_[l]);
    if (has_scatter_) coefficients.push_back(2);
    return coefficients;
  }
  // What the free columns have to explain of a pair's difference.
  [[nodiscard]] double FreePart(const ObservedPair& pair) const {
    double rest = pair.difference;
    for (Eigen::Index l = 0; l < scales_.size(); ++l)
      if (!(scales_[l] > 0)) rest -= declaration_.lipschitz(k_, l) * Along(pair, l);
    return rest;
  }
  // The observations with the largest floor and the least ceiling.
  [[nodiscard]] std::pair<std::size_t, std::size_t> Extremes() const {
    return {ToSize(std::ranges::max_element(entries_.floors) - entries_.floors.begin()),
            ToSize(std::ranges::min_element(entries_.ceilings) - entries_.ceilings.begin())};
  }

  // The pairs that violate the row most, at most one that begins with each observation; none twice over all rounds.
  std::vector<ObservedPair> MostViolated() {
    std::vector<std::pair<double, ObservedPair>> violated;
    const auto consider = [&](std::size_t i, std::size_t j, double excess) {
      if (!(excess > kTolerance * unit_)) return;
      if (!known_.emplace(std::min(i, j), std::max(i, j)).second) return;
      violated.push_back(
          {excess, {static_cast<int>(i), static_cast<int>(j), entries_.floors[i] - entries_.ceilings[j]}});
    };
    const LipschitzRow row(declaration_, k_);
    if (row.is_constant()) {
      const auto [highest, lowest] = Extremes();
      const auto entries = Entries();
      consider(highest, lowest, entries.floors[highest] - entries.ceilings[lowest]);
    } else {
      const auto entries = Entries();
      const ObservationIndex index(entries);
      const PairSearch search(index, MarginUpper(row, entries, observations_));
      for (int i = 0; i < observations_.size(); ++i) {
        const auto other = search.BestOther(PointOf(entries, i), 1, static_cast<std::uint32_t>(i));
        if (other.id != ObservationIndex::kNone) consider(ToSize(i), other.id, entries.floors[ToSize(i)] + other.value);
      }
    }
    const auto kept = std::min(violated.size(), kCutsInARound);
    std::ranges::partial_sort(violated, violated.begin() + static_cast<std::ptrdiff_t>(kept), std::greater{},
                              &std::pair<double, ObservedPair>::first);
    std::vector<ObservedPair> pairs;
    for (std::size_t c = 0; c < violated.size(); ++c) {
      const ObservedPair& pair = violated[c].second;
      if (c < kept)
        pairs.push_back(pair);
      else
        // It may be among the most violated of a later row.
        known_.erase(std::minmax(ToSize(pair.first), ToSize(pair.second)));
    }
    return pairs;
  }

  void FindReasons(const LinearProgram& program, SmallestRow& found) const {
    // By duality, a cut's price says how much of the optimum it forces.
    std::vector<double> largest(found.reasons.size(), 0);
    for (std::size_t p = 0; p < cuts_.size(); ++p)
      for (const Eigen::Index l : free_) {
        const double part = program.Price(p) * declaration_.lipschitz(k_, l) * Along(cuts_[p], l);
        if (!(part > largest[ToSize(l)])) continue;
        largest[ToSize(l)] = part;
        found.reasons[ToSize(l)] = cuts_[p];
      }
  }

  // The program has a tolerance, and the test of a declaration has none. The other rows get errors that nothing
  // contradicts.
  void ScaleUp() {
    Declaration row{Eigen::MatrixXd::Zero(declaration_.lipschitz.rows(), declaration_.lipschitz.cols()),
                    Eigen::VectorXd::Constant(declaration_.noise_bound.size(), kMaxDouble / 8),
                    declaration_.disturbance};
    row.noise_bound[k_] = declaration_.noise_bound[k_];
    for (double more = 1e-12; more < 1; more *= 4) {
      row.lipschitz.row(k_) = declaration_.lipschitz.row(k_);
      if (!FindViolation(row, observations_)) return;
      for (const Eigen::Index l : free_) declaration_.lipschitz(k_, l) *= 1 + more;
    }
  }

  Declaration declaration_;
  const Observations& observations_;
  const int k_;
  const Eigen::RowVectorXd& scales_;
  std::vector<Eigen::Index> free_;
  ObservationIndex::Entries entries_;  // only floors and ceilings are used
  double unit_;                        // the largest difference
  bool has_scatter_ = false;           // the program's last column is an error beyond the declared one
  std::vector<ObservedPair> cuts_;
  std::set<std::pair<std::size_t, std::size_t>> known_;
};

constexpr int kMost = 2000;

// The place in `columns` of the one in which two observations essentially differ alone, or -1.
int LoneColumn(const Eigen::MatrixXd& scaled, Eigen::Index i, Eigen::Index j) {
  double most = 0, second = 0;
  int place = -1;
  for (Eigen::Index c = 0; c < scaled.rows(); ++c) {
    const double difference = std::abs(scaled(c, i) - scaled(c, j));
    if (difference > most) {
      second = most;
      most = difference;
      place = static_cast<int>(c);
    } else {
      second = std::max(second, difference);
    }
  }
  return second <= LoneSlope::kOthers * most ? place : -1;
}

}  // namespace

SmallestRow FindSmallestRow(const Declaration& declaration, const Observations& observations, int coordinate,
                            const Eigen::RowVectorXd& scales) {
  return SmallestRowSearch(declaration, observations, coordinate, scales).Run();
}

double FindScatter(const Declaration& declaration, const Observations& observations, int coordinate,
                   const Eigen::RowVectorXd& scales) {
  return SmallestRowSearch(declaration, observations, coordinate, scales).Scatter();
}

SmallestRow FindSmallestEntry(const Declaration& declaration, const Observations& observations, int coordinate,
                              int column) {
  Eigen::RowVectorXd scales = Eigen::RowVectorXd::Constant(declaration.lipschitz.cols(), -1);
  scales[column] = 1;
  return FindSmallestRow(declaration, observations, coordinate, scales);
}

std::vector<LoneSlope> FindLoneSlopes(const Declaration& declaration, const Observations& observations, int coordinate,
                                      const std::vector<int>& columns) {
  const Eigen::RowVectorXd scales = ScalesOf(observations);
  std::vector<int> varied;
  for (const int l : columns)
    if (scales[l] > 0) varied.push_back(l);
  const std::vector<int> rows = EvenRows(observations.size(), kMost);
  const int count = static_cast<int>(rows.size());
  Eigen::MatrixXd scaled(std::ssize(varied), count);  // an observation a column
  for (Eigen::Index c = 0; c < scaled.rows(); ++c)
    scaled.row(c) = observations.z(rows, varied[ToSize(c)]).transpose() / scales[varied[ToSize(c)]];
  const double error = 2 * declaration.ObservationError(coordinate);
  std::vector<LoneSlope> found(ToSize(scales.size()));
  for (int j = 1; j < count; ++j)
    for (int i = 0; i < j; ++i) {
      const int place = LoneColumn(scaled, i, j);
      if (place < 0) continue;
      const int l = varied[ToSize(place)], first = rows[ToSize(i)], second = rows[ToSize(j)];
      LoneSlope& entry = found[ToSize(l)];
      ++entry.pairs;
      const auto above = [&](int a, int b) {
        return observations.lower(a, coordinate) - observations.upper(b, coordinate);
      };
      const double slope = (std::max(above(first, second), above(second, first)) - error) /
                           std::abs(observations.z(first, l) - observations.z(second, l));
      if (slope > entry.slope) entry.slope = slope, entry.first = first, entry.second = second;
    }
  return found;
}

}  // namespace forereach
