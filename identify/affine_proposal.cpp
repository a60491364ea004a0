#include "identify/affine_proposal.h"

#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <Eigen/QR>

#include "forereach/certify/certifier.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/consistency.h"

namespace forereach {
namespace {

Observations FirstOf(const Observations& all, int count) {
  return {all.z.topRows(count), all.lower.topRows(count), all.upper.topRows(count)};
}

// The least n of (low, high] for which `holds` is true, if it is for `high`: it stays true from there on.
template <class Holds>
std::optional<int> FirstThat(int low, int high, const Holds& holds) {
  if (low >= high || !holds(high)) return std::nullopt;
  while (high - low > 1) {
    const int middle = low + (high - low) / 2;
    (holds(middle) ? high : low) = middle;
  }
  return high;
}

class AffineJudge {
 public:
  AffineJudge(const Problem& problem, const Observations& observations, const ProposedDeclaration& proposal,
              const ProposalOptions& options)
      : observations_(observations),
        proposal_(proposal),
        options_(options),
        scales_(ScalesOf(observations)),
        domain_(problem.domain),
        errors_(proposal.declaration) {
    errors_.lipschitz.setZero();
    errors_.regions.clear();
    for (int l = 0; l < scales_.size(); ++l)
      if (scales_[l] > 0 && std::ranges::any_of(options.columns, [&](const std::vector<int>& of_row) {
            return std::ranges::count(of_row, l) > 0;
          }))
        errors_.affine.columns.push_back(l);
  }

  [[nodiscard]] const std::vector<int>& columns() const { return errors_.affine.columns; }

  [[nodiscard]] JudgedRow Judge(int k) const {
    JudgedRow judged{k, RefuteAffine(errors_, observations_, k, domain_), RefuteSlopes(k),
                     Eigen::RowVectorXd::Zero(scales_.size())};
    if (judged.affine) judged.left = RestOf(k);
    judged.rest_share = scales_.dot(judged.left) / scales_.dot(proposal_.rows[ToSize(k)].smallest.slopes);
    return judged;
  }

  // Makes the row affine; with a rest if it is refuted without.
  void Declare(const JudgedRow& judged, Declaration& declaration) const {
    const int k = judged.row;
    declaration.affine.rows.push_back(k);
    declaration.lipschitz.row(k).setZero();
    const Eigen::VectorXd rest =
        judged.left.unaryExpr([&](double slope) { return RoundedToPrint(options_.factor * slope); });
    declaration.affine.rest.row(k) = rest;
    const AffineSet set = AffineSetOf(declaration, observations_, k, domain_);
    for (int l = 0; l < scales_.size() && set.IsBounded(); ++l) {
      if (!(declaration.VariableError(l) > 0) || !declaration.affine.DependsOn(k, l)) continue;
      const auto j = std::ranges::find(columns(), l) - columns().begin();
      const double slope = j < std::ssize(columns()) ? set.hull(ToSize(static_cast<int>(j))).Magnitude() : 0;
      declaration.lipschitz(k, l) = RoundedToPrint(AddUp(options_.factor * slope, rest[l]));
    }
  }

 private:
  [[nodiscard]] std::optional<Refutation> RefuteSlopes(int k) const {
    const int half = observations_.size() / 2;
    if (half == 0) return std::nullopt;
    const Observations learned = FirstOf(observations_, half);
    // The other rows get errors that nothing contradicts.
    Declaration row = errors_;
    row.noise_bound.setConstant(kMaxDouble / 8);
    row.noise_bound[k] = errors_.noise_bound[k];
    row.lipschitz.row(k) =
        options_.factor *
        FindSmallestRow(errors_, learned, k, FreeScales(ScalesOf(learned), options_.columns[ToSize(k)])).slopes;
    const auto pair = [&](int n) { return FindViolation(row, FirstOf(observations_, n)); };
    const auto after = FirstThat(half, observations_.size(), [&](int n) { return pair(n).has_value(); });
    if (!after) return std::nullopt;
    const Violation violation = *pair(*after);
    return Refutation{*after, {violation.first, violation.second}};
  }

  // The smallest slopes of what the plane that fits best leaves.
  [[nodiscard]] Eigen::RowVectorXd RestOf(int k) const {
    Eigen::MatrixXd phi(observations_.size(), std::ssize(columns()) + 1);
    phi << observations_.z(Eigen::all, columns()), Eigen::VectorXd::Ones(observations_.size());
    const Eigen::VectorXd middle = (observations_.lower.col(k) + observations_.upper.col(k)) / 2,
                          plane = phi * phi.colPivHouseholderQr().solve(middle);
    Observations left = observations_;
    left.lower.col(k) -= plane;
    left.upper.col(k) -= plane;
    return FindSmallestRow(errors_, left, k, FreeScales(scales_, columns())).slopes;
  }

  const Observations& observations_;
  const ProposedDeclaration& proposal_;
  const ProposalOptions& options_;
  const Eigen::RowVectorXd scales_;
  const Domain& domain_;
  Declaration errors_;  // The proposed ones, without slopes, and the columns.
};

}  // namespace

AffineSet AffineSetOf(const Declaration& declaration, const Observations& observations, int k, const Domain& domain) {
  const auto [lower, upper] = domain.Corners();
  Eigen::VectorXd rest;
  if (declaration.affine.rest.size() > 0) rest = declaration.affine.rest.row(k);
  AffineSet set(declaration.affine.columns, lower, upper, {rest.data(), ToSize(rest.size())});
  const double error = declaration.ObservationError(k);
  for (int i = 0; i < observations.size(); ++i) {
    const Eigen::VectorXd z = observations.z.row(i);
    set.Add(i, {z.data(), ToSize(z.size())}, SubDown(observations.lower(i, k), error),
            AddUp(observations.upper(i, k), error));
  }
  set.Derive();
  return set;
}

std::optional<Refutation> RefuteAffine(const Declaration& declaration, const Observations& observations, int k,
                                       const Domain& domain) {
  const auto shown = [&](int n) {
    return AffineSetOf(declaration, FirstOf(observations, n), k, domain).contradiction();
  };
  const auto after = FirstThat(0, observations.size(), [&](int n) { return shown(n).has_value(); });
  if (!after) return std::nullopt;
  Refutation found{*after, shown(*after)->rows};
  std::ranges::sort(found.by);
  return found;
}

AffineProposal ProposeAffine(const Problem& problem, const Observations& observations,
                             const ProposedDeclaration& proposal, const ProposalOptions& options) {
  const AffineJudge judge(problem, observations, proposal, options);
  AffineProposal found{judge.columns(), {}, proposal.declaration, ""};
  if (found.columns.size() > AffineRows::kMaxColumns) {
    found.why_none = fmt::format("an affine row has at most {} columns, and here {} vary: name fewer (--by)",
                                 AffineRows::kMaxColumns, found.columns.size());
    return found;
  }
  Declaration& declaration = found.declaration;
  declaration.regions.clear();
  declaration.affine = {
      {}, found.columns, Eigen::MatrixXd::Zero(declaration.lipschitz.rows(), declaration.lipschitz.cols())};
  for (int k = 0; k < observations.num_states(); ++k) {
    if (proposal.declaration.lipschitz.row(k).isZero(0)) continue;
    found.rows.push_back(judge.Judge(k));
    if (found.rows.back().rest_share <= AffineProposal::kMostRest) judge.Declare(found.rows.back(), declaration);
  }
  bool is_usable = !declaration.affine.rows.empty();
  if (is_usable) {
    auto with = std::make_shared<Problem>(problem);
    with->declaration = declaration;
    const Certifier certifier(with);
    found.why_none = certifier.Unexcited();
    // What was rounded on the way may contradict: who decides about plans has the last word.
    if (found.why_none.empty() && certifier.violation())
      found.why_none = "the observations contradict them as they would be printed";
    is_usable = found.why_none.empty();
  }
  if (!is_usable) declaration = proposal.declaration;
  return found;
}

}  // namespace forereach
