#include "identify/import.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include <fmt/format.h>

#include "forereach/certify/learned.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/reach/domain.h"
#include "task/config_error.h"

namespace forereach {
namespace {

constexpr long double kTurn = 2 * std::numbers::pi_v<long double>;
constexpr double kJitter = 0.1;  // of a step, by which the stamps of a log with the task's step may typically be late

struct Sample {
  long double time;  // s; only differences within a piece are exact enough to mean something
  Eigen::Index row;
  bool begins_piece;  // no transition spans the boundary before it
  bool has_states;    // otherwise commands alone begin there
};

// The middle one, of an even number the larger; 0 if there is none.
double MedianOf(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

class Importer {
 public:
  Importer(const LogTable& table, const Problem& problem, const ImportOptions& options)
      : table_(table),
        problem_(problem),
        options_(options),
        first_column_(options.time_unit > 0 ? 1 : 0),
        n_(problem.model->num_states()),
        m_(problem.model->num_inputs()) {
    log_.largest_rate = Eigen::VectorXd::Zero(n_);
    log_.input_deviation = Eigen::VectorXd::Zero(m_);
  }

  ImportedLog Run() {
    CollectSamples();
    RequireFineEnough();
    for (std::size_t i = 0; i < samples_.size();) {
      const std::size_t end = samples_[i].has_states ? Try(i) : 0;
      i = end == 0 || options_.overlapping ? i + 1 : end;
    }
    const auto count = std::ssize(log_.lines);
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const RowMajor> rows(numbers_.data(), count, 2 * n_ + m_);
    log_.transitions = {rows.leftCols(n_ + m_), rows.rightCols(n_)};
    if (options_.counts_durations) log_.transitions.longer = Eigen::Map<const Eigen::VectorXd>(longer_.data(), count);
    log_.samples = static_cast<int>(CountStates(0, samples_.size()));
    log_.rows = table_.num_rows() + table_.lost.count - log_.At(Dropped::kRepeatedRow).count -
                log_.At(Dropped::kOutsideWindow).count;
    log_.median_gap = MedianOf(gaps_);
    log_.largest_gap = gaps_.empty() ? 0 : *std::ranges::max_element(gaps_);
    return std::move(log_);
  }

 private:
  // ---- rows to samples

  // The stamp in s, NaN if there is none.
  [[nodiscard]] long double TimeOf(Eigen::Index row) const {
    if (first_column_ == 0) return static_cast<long double>(row) * options_.row_spacing;
    return table_.values(row, 0) * options_.time_unit;
  }
  [[nodiscard]] bool SameValues(Eigen::Index a, Eigen::Index b) const {
    for (Eigen::Index j = first_column_; j < table_.values.cols(); ++j) {
      const double x = table_.values(a, j), y = table_.values(b, j);
      if (!(x == y || (std::isnan(x) && std::isnan(y)))) return false;
    }
    return true;
  }
  [[nodiscard]] int LineOf(Eigen::Index row) const { return table_.lines[ToSize(row)]; }
  void Drop(Dropped cause, Eigen::Index row, const std::string& what = "") { log_.At(cause).Add(LineOf(row), what); }

  // Commands are no rows that somebody misses.
  void DropRow(Dropped cause, Eigen::Index row) {
    if (table_.HasStates(row)) Drop(cause, row);
  }

  [[nodiscard]] std::int64_t CountStates(std::size_t begin, std::size_t end) const {
    return std::count_if(samples_.begin() + static_cast<std::ptrdiff_t>(begin),
                         samples_.begin() + static_cast<std::ptrdiff_t>(end),
                         [](const Sample& sample) { return sample.has_states; });
  }

  void CollectSamples() {
    log_.At(Dropped::kRowLost) = table_.lost;
    const Eigen::Index rows = table_.values.rows();
    bool has_origin = false, broken = true;
    long double origin = 0, last = 0;
    for (Eigen::Index row = 0; row < rows;) {
      broken |= table_.after_loss[ToSize(row)];
      const long double time = TimeOf(row);
      if (!std::isfinite(time)) {
        Drop(Dropped::kNoStamp, row++);
        broken = true;
        continue;
      }
      if (!has_origin) {
        origin = time, has_origin = true;
      } else if (time < last) {  // two runs in one file, or a clock that was set: no transition spans it
        Drop(Dropped::kBackwards, row);
        broken = true;
      }
      last = time;
      const auto [end, same] = Repetitions(row, time);
      if (!same) {
        for (Eigen::Index i = row; i < end; ++i) Drop(Dropped::kRepeatedStamp, i);
        broken = true;
      } else {
        for (Eigen::Index i = row + 1; i < end; ++i) Drop(Dropped::kRepeatedRow, i);
        const long double since = time - origin;
        if (options_.from <= since && since <= options_.until)
          samples_.push_back({time, row, std::exchange(broken, false), table_.HasStates(row)});
        else
          DropRow(Dropped::kOutsideWindow, row), broken = true;
      }
      row = end;
    }
  }

  // The end of the rows with the stamp of the first, and whether all have its values.
  [[nodiscard]] std::pair<Eigen::Index, bool> Repetitions(Eigen::Index first, long double time) const {
    bool same = true;
    Eigen::Index end = first + 1;
    for (; end < table_.values.rows() && !table_.after_loss[ToSize(end)] && TimeOf(end) == time; ++end)
      same &= SameValues(first, end);
    return {end, same};
  }

  void RequireFineEnough() {
    std::vector<double> spacings;
    const Sample* last = nullptr;
    for (const Sample& sample : samples_) {
      if (sample.begins_piece) last = nullptr;
      if (!sample.has_states) continue;
      if (last) spacings.push_back(static_cast<double>(sample.time - last->time));
      last = &sample;
    }
    log_.typical_spacing = MedianOf(spacings);
    if (!(log_.typical_spacing > (1 + kJitter) * options_.period + options_.tolerance)) return;
    if (const Finding& back = log_.At(Dropped::kBackwards); back.count > 0)
      throw ConfigError(
          "{}: its stamps go back, {} times, first in line {}, and between these lines its rows are typically {:.6g} s "
          "apart, more than a step of the task, {} s: sort the rows by their stamps if they are of one run",
          table_.path, back.count, back.first_line, log_.typical_spacing, ToText(options_.period));
    throw ConfigError(
        "{}: its rows are typically {:.6g} s apart, and a step of the task is {} s; states are not "
        "interpolated: record faster, or let model.dt be a multiple of the log's spacing; if the stamps "
        "are not in s, give their unit with --time-unit",
        table_.path, log_.typical_spacing, ToText(options_.period));
  }

  // ---- samples to transitions

  [[nodiscard]] double Value(std::size_t i, Eigen::Index variable) const {
    return static_cast<double>(options_.factors[ToSize(variable)] *
                               table_.values(samples_[i].row, first_column_ + variable));
  }

  // The input that acts from sample i on.
  [[nodiscard]] double CommandAt(std::size_t i, Eigen::Index variable) const {
    for (int d = 0; d < options_.command_delay; ++d)
      if (samples_[i].begins_piece || i-- == 0) return std::numeric_limits<double>::quiet_NaN();
    return Value(i, variable);
  }

  [[nodiscard]] long double TargetOf(std::size_t i) const { return samples_[i].time + options_.period; }

  // How far the stamps of samples i and j may be off t_i + dt by the rounding of decimals to doubles.
  [[nodiscard]] long double RoundingOf(std::size_t i, std::size_t j) const {
    const long double size = std::max(std::abs(samples_[i].time), std::abs(samples_[j].time)) + options_.period;
    return std::min(std::numeric_limits<double>::epsilon() * size, ImportOptions::kRounding * options_.period);
  }

  // The sample nearest to a step behind sample i in its piece, 0 with the cause counted if there is none.
  std::size_t EndOf(std::size_t i) {
    const long double target = TargetOf(i);
    const auto offset = [&](std::size_t at) { return std::abs(samples_[at].time - target); };
    std::size_t j = i, at = i + 1;  // the last one before the target, which may be i, or the nearest one
    for (; at < samples_.size() && !samples_[at].begins_piece; ++at) {
      if (!samples_[at].has_states) continue;
      if (samples_[at].time >= target) break;
      j = at;
    }
    const bool ends = at == samples_.size() || samples_[at].begins_piece;
    if (!ends && (j == i || offset(at) <= offset(j))) j = at;
    if (j > i && offset(j) <= options_.tolerance + RoundingOf(i, j)) return j;
    if (!ends) gaps_.push_back(static_cast<double>(offset(j)));
    Drop(ends ? Dropped::kEnd : Dropped::kGap, samples_[i].row);
    return 0;
  }

  // Sets `input` to that of the step. False with the cause counted if the step has none.
  bool FindInput(std::size_t i, std::size_t j, std::span<double> input, std::span<double> deviation) {
    for (Eigen::Index l = 0; l < m_; ++l) {
      const auto at = [&](std::size_t sample) { return CommandAt(sample, n_ + l); };
      long double sum = 0;
      for (std::size_t row = i; row < j; ++row) {
        if (!std::isfinite(at(row))) {
          Drop(Dropped::kNoInput, samples_[i].row, problem_.model->input_names()[ToSize(l)]);
          return false;
        }
        sum += at(row) * (samples_[row + 1].time - samples_[row].time);
      }
      double& u = input[ToSize(l)];
      u = options_.input_mean ? static_cast<double>(sum / (samples_[j].time - samples_[i].time)) : at(i);
      for (std::size_t row = i; row < j; ++row)
        deviation[ToSize(l)] = std::max(deviation[ToSize(l)], std::abs(at(row) - u));
      if (!options_.input_mean && deviation[ToSize(l)] > options_.input_tolerance[l]) {
        Drop(Dropped::kInputChanges, samples_[i].row, problem_.model->input_names()[ToSize(l)]);
        return false;
      }
    }
    return true;
  }

  // The sample one step before sample i in its piece; i if there is none.
  [[nodiscard]] std::size_t BeginBefore(std::size_t i) const {
    const long double target = samples_[i].time - options_.period;
    for (std::size_t begin = i; begin > 0 && !samples_[begin].begins_piece;) {
      const long double offset = samples_[--begin].time - target;
      if (offset > options_.tolerance + RoundingOf(begin, i)) continue;
      return -offset > options_.tolerance + RoundingOf(begin, i) ? i : begin;
    }
    return i;
  }

  // Sets the states that hold inputs of the step before. False with the cause counted if it has none.
  bool FindHeld(std::size_t i, std::span<const double> input, std::span<double> state, std::span<double> next) {
    if (options_.held.empty()) return true;
    const std::size_t begin = BeginBefore(i);
    if (begin == i) {
      Drop(Dropped::kNoState, samples_[i].row, problem_.model->state_names()[ToSize(options_.held.front().first)]);
      return false;
    }
    std::array<double, kMaxInputs> before{}, deviation{};
    if (!FindInput(begin, i, before, deviation)) return false;
    for (const auto& [k, l] : options_.held) state[ToSize(k)] = before[ToSize(l)], next[ToSize(k)] = input[ToSize(l)];
    return true;
  }

  bool FindStates(std::size_t i, std::size_t j, std::span<double> state, std::span<double> next) {
    for (Eigen::Index k = 0; k < n_; ++k) {
      if (std::ranges::find(options_.held, k, &std::pair<int, int>::first) != options_.held.end()) continue;
      state[ToSize(k)] = Value(i, k);
      next[ToSize(k)] = Value(j, k);
      if (std::isfinite(state[ToSize(k)]) && std::isfinite(next[ToSize(k)])) continue;
      Drop(Dropped::kNoState, samples_[i].row, problem_.model->state_names()[ToSize(k)]);
      return false;
    }
    for (const int k : options_.unwrapped) {
      const long double turns = std::round((static_cast<long double>(state[ToSize(k)]) - next[ToSize(k)]) / kTurn);
      next[ToSize(k)] = static_cast<double>(next[ToSize(k)] + turns * kTurn);
    }
    return true;
  }

  // The sample that ends the transition from sample i, or 0 with the cause counted.
  std::size_t Try(std::size_t i) {
    const std::size_t j = EndOf(i);
    if (j == 0) return 0;
    std::array<double, kMaxVariables> z;
    std::array<double, kMaxStates> next;
    std::array<double, kMaxInputs> deviation{};
    const std::span<double> location(z.data(), ToSize(n_ + m_)), successor(next.data(), ToSize(n_));
    if (!FindStates(i, j, location.first(ToSize(n_)), successor)) return 0;
    if (!FindInput(i, j, location.subspan(ToSize(n_)), deviation)) return 0;
    if (!FindHeld(i, location.subspan(ToSize(n_)), location.first(ToSize(n_)), successor)) return 0;
    const double offset = OffsetOf(i, j), longer = offset > 0 ? LongerOf(offset, i, j) : 0;
    Observations observed;
    switch (Observe(problem_, location, successor, options_.counts_durations ? longer : 0, observed)) {
      case Learned::kAdded: break;
      case Learned::kNotFinite: Drop(Dropped::kNoState, samples_[i].row); return 0;
      case Learned::kOutsideDomain: Drop(Dropped::kOutsideDomain, samples_[i].row, ConstraintAt(location)); return 0;
      case Learned::kNearTheEdge: Drop(Dropped::kNearTheEdge, samples_[i].row); return 0;
      case Learned::kNoNominalSlope:
      case Learned::kNoNominalValue: Drop(Dropped::kNoNominalValue, samples_[i].row); return 0;
      case Learned::kAmbiguousAngle: Drop(Dropped::kAmbiguousAngle, samples_[i].row); return 0;
    }
    numbers_.insert(numbers_.end(), location.begin(), location.end());
    numbers_.insert(numbers_.end(), successor.begin(), successor.end());
    log_.lines.push_back(LineOf(samples_[i].row));
    // Transitions may share samples, and each counts once.
    log_.rows_used += CountStates(std::max(i, next_unused_), j + 1);
    next_unused_ = j + 1;
    longer_.push_back(longer);
    Note(offset, location, successor, deviation);
    return j;
  }

  // Of an angle without whole turns.
  [[nodiscard]] double Change(Eigen::Index k, std::span<const double> z, std::span<const double> next) const {
    const double change = next[ToSize(k)] - z[ToSize(k)];
    return problem_.model->IsAngle(static_cast<int>(k)) ? std::remainder(change, 2 * std::numbers::pi) : change;
  }

  // |t_j - t_i - dt|; what may be rounding of stamps to doubles counts as 0.
  [[nodiscard]] double OffsetOf(std::size_t i, std::size_t j) const {
    const long double offset = std::abs(samples_[j].time - TargetOf(i));
    return offset > RoundingOf(i, j) ? static_cast<double>(offset) : 0;
  }

  // What stamps in doubles may hide counts, too.
  [[nodiscard]] double LongerOf(double offset, std::size_t i, std::size_t j) const {
    return NextUp(static_cast<double>(offset + RoundingOf(i, j)));
  }

  void Note(double offset, std::span<const double> z, std::span<const double> next, std::span<const double> deviation) {
    log_.largest_offset = std::max(log_.largest_offset, offset);
    for (Eigen::Index k = 0; k < n_; ++k)
      log_.largest_rate[k] = std::max(log_.largest_rate[k], std::abs(Change(k, z, next)) / options_.period);
    for (Eigen::Index l = 0; l < m_; ++l)
      log_.input_deviation[l] = std::max(log_.input_deviation[l], deviation[ToSize(l)]);
  }

  // "v 3.2", for a coordinate outside its range.
  [[nodiscard]] std::string ConstraintAt(std::span<const double> z) const {
    std::array<Interval, kMaxVariables> point;
    for (std::size_t l = 0; l < z.size(); ++l) point[l] = Interval(z[l]);
    const DomainExit exit = FindExit(problem_.domain, {point.data(), z.size()});
    if (exit.kind != DomainExit::Kind::kLower && exit.kind != DomainExit::Kind::kUpper) return "";
    return fmt::format("{} {}", problem_.model->variable_names()[ToSize(exit.index)], ToText(z[ToSize(exit.index)]));
  }

  const LogTable& table_;
  const Problem& problem_;
  const ImportOptions& options_;
  const Eigen::Index first_column_, n_, m_;
  std::vector<Sample> samples_;
  std::size_t next_unused_ = 0;  // the sample behind the last one of a transition
  std::vector<double> numbers_;  // row by row
  std::vector<double> longer_;   // of each transition
  std::vector<double> gaps_;     // from t + dt to the nearest stamp, of the starts without one near
  ImportedLog log_;
};

}  // namespace

const DroppedWords& WordsOf(Dropped dropped) {
  static constexpr DroppedWords kWords[] = {
      {"row_lost", "rows with other fields than the header",
       "mend these lines, or say with --delimiter what separates their fields"},
      {"no_stamp", "rows without a stamp", "write the stamps as decimal numbers or dates of ISO 8601"},
      {"repeated_row", "rows that repeat the one before", ""},
      {"repeated_stamp", "rows with another row's stamp and other values",
       "leave one row for each stamp; seconds_of(SEC,NSEC) is one stamp of two columns"},
      {"backwards", "stamps that go backwards: a new piece begins",
       "sort the rows by their stamps if they are of one run"},
      {"outside_window", "rows before --from or after --until", ""},
      {"end", "starts whose step goes past the end", "record longer runs without a break"},
      {"gap", "starts without a stamp near t + dt",
       "raise --tolerance-ms, or let model.dt be a multiple of the log's spacing"},
      {"no_state", "starts with a state that is no number", "write these fields as decimal numbers"},
      {"no_input", "starts with an input that is no number",
       "write these fields as decimal numbers; inputs in rows of their own can be given with --inputs-from, "
       "whose last row holds no longer than its stamp"},
      {"input_changes", "starts whose input is not constant over the step", "give --input-mean or --input-tolerance"},
      {"outside_domain", "starts outside the task's domain",
       "widen the task's domain, or give the columns' units with --unit"},
      {"near_the_edge", "starts that the declared errors may take out of the task's domain", "widen the task's domain"},
      {"no_nominal_value", "starts where the nominal model has no value", "mend the model's equations there"},
      {"ambiguous_angle", "starts of steps in which the turns of an angle cannot be told",
       "record in rad, or with a smaller model.dt"},
  };
  static_assert(std::size(kWords) == static_cast<std::size_t>(Dropped::kCount));
  return kWords[static_cast<std::size_t>(dropped)];
}

ImportedLog Import(const LogTable& table, const Problem& problem, const ImportOptions& options) {
  return Importer(table, problem, options).Run();
}

}  // namespace forereach
