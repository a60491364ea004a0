/** An experiment of the paper: which cells it needs, and the tables and pictures that come of them. */
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "research/cell.h"
#include "research/plot.h"
#include "research/table.h"

namespace forereach::research {

/** How much of the paper's grid a run takes. */
struct Scope {
  int seeds = 10;
  bool quick = false;  ///< The smallest and the largest N only

  [[nodiscard]] std::vector<int> SizesOf(const System& system) const;
};

/** @name Of a tally; none where the denominator is zero. */
///@{
using Statistic = std::optional<double> (*)(const Tally&);
[[nodiscard]] std::optional<double> Recall(const Tally& tally);           ///< certified and safe / safe
[[nodiscard]] std::optional<double> Coverage(const Tally& tally);         ///< covered / complete
[[nodiscard]] std::optional<double> CompleteRate(const Tally& tally);     ///< complete / plans
[[nodiscard]] std::optional<double> JointRate(const Tally& tally);        ///< covered / plans
[[nodiscard]] std::optional<double> CertificateRate(const Tally& tally);  ///< certified / plans
[[nodiscard]] std::optional<double> FalseSafeRate(const Tally& tally);    ///< certified and not safe / certified
[[nodiscard]] std::optional<double> DomainRate(const Tally& tally);       ///< D / plans
[[nodiscard]] std::optional<double> SafetyRate(const Tally& tally);       ///< S / plans
[[nodiscard]] std::optional<double> FalsifiedRate(const Tally& tally);    ///< F / plans
///@}

/** Finished cells, by their key, of a scope. */
struct Results final {
  Results(Scope of, const std::vector<Cell>& cells, const std::vector<CellResult>& results);

  /** @throws std::invalid_argument naming the cell if it was not asked for. */
  [[nodiscard]] const CellResult& Of(const Cell& cell) const;
  [[nodiscard]] const Tally& Of(const Cell& cell, Group group) const {
    return Of(cell)[static_cast<std::size_t>(group)];
  }
  /** Of a statistic over the seeds of the scope, whatever the cell's own. */
  [[nodiscard]] Estimate Mean(Cell cell, Group group, Statistic statistic) const;
  /** Certificates of plans that are not target-safe, all seeds of the scope together: of every group, or of one. */
  [[nodiscard]] int FalseCertificates(const Cell& cell) const;
  [[nodiscard]] int FalseCertificates(Cell cell, Group group) const;

  const Scope scope;

 private:
  std::map<std::string, CellResult> by_key_;
};

struct Experiment {
  std::string name, about;                               ///< A word for the command line, a line for its help
  std::function<std::vector<Cell>(const Scope&)> cells;  ///< Empty: it needs none
  std::function<std::vector<Table>(const Results&)> tables;
  std::function<std::vector<Plot>(const Results&)> plots = {};  ///< May be empty
};

/** All of them, in the order of the report. */
[[nodiscard]] std::span<const Experiment> Experiments();

/** Mean and spread of what each seed of the scope gives. */
[[nodiscard]] Estimate OverSeeds(const Scope& scope, const std::function<std::optional<double>(int seed)>& value);
/** The cell with each seed of the scope. */
void AddSeeds(const Scope& scope, Cell cell, std::vector<Cell>& cells);

/** @name The experiments, by the quantity that they vary. */
///@{
[[nodiscard]] Experiment MainResults();
[[nodiscard]] Experiment RecallByN();
[[nodiscard]] Experiment DirectCoverage();
[[nodiscard]] Experiment Comparison();
[[nodiscard]] Experiment Readings();
[[nodiscard]] Experiment NoisyComparison();
[[nodiscard]] Experiment CertificateBudget();
[[nodiscard]] Experiment DomainExits();
[[nodiscard]] Experiment FirstAbstentions();
[[nodiscard]] Experiment TubeGeometry();
[[nodiscard]] Experiment BoxAgainstZonotope();
[[nodiscard]] Experiment ScalarEnvelope();
[[nodiscard]] Experiment NoiseSweep();
[[nodiscard]] Experiment IncorrectDeclarations();
[[nodiscard]] Experiment ParameterBoxes();
[[nodiscard]] Experiment NormRatios();
[[nodiscard]] Experiment NominalDegradation();
[[nodiscard]] Experiment InformationLimits();
[[nodiscard]] Experiment AssumptionFamilies();
[[nodiscard]] Experiment EstimatedSlopes();
[[nodiscard]] Experiment AdversarialFamily();
[[nodiscard]] Experiment KeptDeclaration();
[[nodiscard]] Experiment CertifiedDeclarations();
[[nodiscard]] Experiment ActionChunks();
///@}

}  // namespace forereach::research
