#include "identify/calm_regions.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "identify/noise_floor.h"
#include "identify/proposal.h"

namespace forereach {
namespace {

constexpr int kMostCompared = 1000, kMostCut = 4000;  // observations that make r^, and that say where to cut
constexpr int kCuts = 15;                             // that are tried along each variable of a cell
constexpr double kRoom = 0.05;                        // around the observations

// Upwards, to what a person reads in a task file.
double RoundedShort(double x) { return std::strtod(RoundedUp(x, 4).c_str(), nullptr); }

struct Cell {
  std::vector<Interval> box;  // by variable of z
  std::vector<int> members;
  Eigen::VectorXd needed;  // by state: the largest of its members
};

class CellSearch final {
 public:
  CellSearch(const Declaration& declaration, const Observations& observations, const std::vector<int>& variables,
             const CalmOptions& options)
      : declaration_(declaration),
        seen_(observations),
        variables_(variables),
        options_(options),
        compared_(EvenRows(seen_.size(), kMostCompared)) {
    for (int k = 0; k < seen_.num_states(); ++k)  // beside an expression, a task file has no number
      if (declaration_.DisturbanceBound(k) > 0 && !declaration_.Grows(k)) rows_.push_back(k);
    Cell all{{}, EvenRows(seen_.size(), kMostCut), {}};
    for (Eigen::Index l = 0; l < seen_.z.cols(); ++l) {
      const double least = seen_.z.col(l).minCoeff(), most = seen_.z.col(l).maxCoeff(), room = kRoom * (most - least);
      all.box.emplace_back(-RoundedShort(room - least), RoundedShort(most + room));
    }
    cells_.push_back(std::move(all));
  }

  // Cuts by some observations, then lets all of them say what the cells need.
  void Run() {
    if (rows_.empty()) return;
    do Compare();
    while (std::ssize(cells_) < options_.most_cells && CutOnce());
    // A sample says where to cut; a bound that holds has to hold for every observation.
    for (Cell& cell : cells_) cell.members.clear();
    for (int i = 0; i < seen_.size(); ++i)
      std::ranges::find_if(cells_, [&](const Cell& cell) {
        return std::ranges::all_of(cut_, [&](int l) { return cell.box[ToSize(l)].Contains(seen_.z(i, l)); });
      })->members.push_back(i);
    Compare();
  }

  [[nodiscard]] std::vector<CalmRegion> Regions() const {
    std::vector<CalmRegion> regions;
    for (const Cell& cell : cells_) {
      CalmRegion found{{{}, declaration_.lipschitz}, static_cast<int>(cell.members.size())};
      found.region.disturbance.setConstant(seen_.num_states(), kInfinity);
      for (const int k : rows_)
        if (const double w = RoundedShort(options_.factor * cell.needed[k]); w < declaration_.DisturbanceBound(k))
          found.region.disturbance[k] = w;
      for (const int l : cut_) found.region.box.push_back({l, cell.box[ToSize(l)]});
      std::ranges::sort(found.region.box, {}, &Region::Side::variable);
      if (!cut_.empty() && (found.region.disturbance.array() < kInfinity).any()) regions.push_back(std::move(found));
    }
    return regions;
  }

 private:
  // Sets what each observation and each cell needs, for an r^ that knows what the cells needed so far.
  void Compare() {
    std::vector<double> cell_needs(ToSize(seen_.size()), kInfinity);  // of those that are in no cell yet
    needed_.setZero(seen_.size(), seen_.num_states());
    for (const int k : rows_) {
      for (const Cell& cell : cells_)
        for (const int i : cell.members)
          cell_needs[ToSize(i)] = cell.needed.size() == 0 ? declaration_.DisturbanceBound(k) : cell.needed[k];
      const double sigma = declaration_.noise_bound[k];
      for (const Cell& cell : cells_)
        for (const int i : cell.members) {
          double least = -kInfinity, most = kInfinity;
          for (const int j : compared_) {
            const double away = declaration_.lipschitz.row(k).dot((seen_.z.row(i) - seen_.z.row(j)).cwiseAbs()) +
                                sigma + cell_needs[ToSize(j)];
            least = std::max(least, seen_.lower(j, k) - away);
            most = std::min(most, seen_.upper(j, k) + away);
          }
          const double middle = least / 2 + most / 2;
          needed_(i, k) = std::max({seen_.lower(i, k) - middle, middle - seen_.upper(i, k), sigma}) - sigma;
        }
    }
    for (Cell& cell : cells_) cell.needed = Largest(cell.members);
  }

  [[nodiscard]] Eigen::VectorXd Largest(const std::vector<int>& members) const {
    Eigen::VectorXd largest = Eigen::VectorXd::Zero(seen_.num_states());
    for (const int i : members) largest = largest.cwiseMax(needed_.row(i).transpose());
    return largest;
  }

  [[nodiscard]] double Cost(const Eigen::VectorXd& needed, std::size_t members) const {
    double sum = 0;
    for (const int k : rows_) sum += needed[k] / declaration_.DisturbanceBound(k);
    return sum * static_cast<double>(members) /
           static_cast<double>(std::min(seen_.size(), kMostCut) * std::ssize(rows_));
  }

  struct Cut {
    double gain = 0;
    std::size_t cell = 0;
    int variable = -1;
    double at = 0;
  };

  // The best of those between neighbours in the order of a variable, at even shares of the members.
  void TryAlong(std::size_t c, int variable, Cut& best) const {
    const Cell& cell = cells_[c];
    std::vector<int> order = cell.members;
    std::ranges::sort(order, {}, [&](int i) { return seen_.z(i, variable); });
    const auto place = [&](std::size_t i) { return seen_.z(order[i], variable); };
    for (int share = 1; share <= kCuts; ++share) {
      const std::size_t begin = order.size() * ToSize(share) / (kCuts + 1);
      if (begin < ToSize(options_.fewest) || order.size() - begin < ToSize(options_.fewest) ||
          !(place(begin - 1) < place(begin)))
        continue;
      const double between = place(begin - 1) / 2 + place(begin) / 2;
      const double shown = std::strtod(fmt::format("{:.4g}", between).c_str(), nullptr);
      const double at = place(begin - 1) < shown && shown < place(begin) ? shown : between;
      const auto middle = order.begin() + static_cast<std::ptrdiff_t>(begin);
      const double gain = Cost(cell.needed, order.size()) - Cost(Largest({order.begin(), middle}), begin) -
                          Cost(Largest({middle, order.end()}), order.size() - begin);
      if (gain > best.gain) best = {gain, c, variable, at};
    }
  }

  bool CutOnce() {
    Cut best{.gain = options_.least_gain};
    for (std::size_t c = 0; c < cells_.size(); ++c)
      for (const int l : variables_)
        if (std::ranges::count(cut_, l) > 0 || cut_.size() < Region::kMaxVariables) TryAlong(c, l, best);
    if (best.variable < 0 || !FitsGrid(best)) return false;
    const auto l = ToSize(best.variable);
    if (std::ranges::count(cut_, best.variable) == 0) cut_.push_back(best.variable);
    Cell above = cells_[best.cell];
    Cell& below = cells_[best.cell];
    below.box[l].upper = above.box[l].lower = best.at;
    std::erase_if(below.members, [&](int i) { return seen_.z(i, best.variable) > best.at; });
    std::erase_if(above.members, [&](int i) { return !(seen_.z(i, best.variable) > best.at); });
    cells_.push_back(std::move(above));
    return true;
  }

  // Whether the sides of all cells still make no more cells of a grid than a declaration may have.
  [[nodiscard]] bool FitsGrid(const Cut& next) const {
    std::size_t product = 1;
    for (std::size_t l = 0; l < cells_[0].box.size(); ++l) {
      std::vector<double> sides;
      if (static_cast<int>(l) == next.variable) sides.push_back(next.at);
      for (const Cell& cell : cells_) sides.insert(sides.end(), {cell.box[l].lower, cell.box[l].upper});
      std::ranges::sort(sides);
      sides.erase(std::unique(sides.begin(), sides.end()), sides.end());
      if (static_cast<int>(l) == next.variable || std::ranges::count(cut_, static_cast<int>(l)) > 0)
        product *= sides.size() + 1;
    }
    return product <= Region::kMaxCells;
  }

  const Declaration& declaration_;
  const Observations& seen_;
  const std::vector<int>& variables_;
  const CalmOptions options_;
  std::vector<int> compared_, rows_, cut_;
  std::vector<Cell> cells_;
  Eigen::MatrixXd needed_;  // by observation and state
};

}  // namespace

std::vector<CalmRegion> FindCalmRegions(const Declaration& declaration, const Observations& observations,
                                        const std::vector<int>& variables, const CalmOptions& options) {
  CellSearch search(declaration, observations, variables, options);
  search.Run();
  return search.Regions();
}

}  // namespace forereach
