#include "forereach/residual/observation_store.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "forereach/numerics/size.h"
#include "forereach/residual/pairs.h"
#include "forereach/residual/retention.h"

namespace forereach {

// One observation: d_z and n entries.
struct ObservationStore::Entry {
  std::span<const double> z, lower, upper;
};

// An index of the rows from the end of the piece before it on.
struct ObservationStore::Piece {
  std::shared_ptr<const LipschitzEnvelope> envelope;
  int end;
};

// The pieces, the first of which has the first rows, and a tail. Entries of the tail below its size do not change any
// more, and neither do pieces. Their limits are the same.
struct ObservationStore::Generation {
  ObservationRows rows;  // those of the pieces, and behind them those of the tail
  std::vector<Piece> pieces;
  EnvelopeTail tail;

  Generation(const Declaration& declaration, ObservationRows known, std::vector<Piece> of_known, int tail_capacity)
      : rows(std::move(known)), pieces(std::move(of_known)), tail(declaration, first(), tail_capacity) {
    rows.Reserve(tail_capacity);
  }

  [[nodiscard]] const LipschitzEnvelope& first() const { return *pieces.front().envelope; }
  [[nodiscard]] int indexed() const { return pieces.back().end; }
  [[nodiscard]] bool HasRoom() const { return tail.size() < tail.capacity(); }

  void Append(int id, const Entry& entry) {
    rows.Append(id, entry.z, entry.lower, entry.upper);
    tail.Append(entry.z, entry.lower, entry.upper);
  }
};

void ObservationStore::Snapshot::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  generation_->first().Enclose(query, generation_->tail, tail_size_, bounds);
  for (const Piece& piece : std::span(generation_->pieces).subspan(1)) {
    ResidualBounds others;
    piece.envelope->Enclose(query, others);
    for (std::size_t k = 0; k < ToSize(piece.envelope->num_states()); ++k) {
      bounds.lower[k] = std::max(bounds.lower[k], others.lower[k]);
      bounds.upper[k] = std::min(bounds.upper[k], others.upper[k]);
    }
    bounds.capped |= others.capped;
  }
}

std::size_t ObservationStore::Snapshot::size() const { return ToSize(generation_->indexed() + tail_size_); }

std::vector<int> ObservationStore::Snapshot::ids() const {
  std::vector<int> ids(size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = generation_->rows.id(static_cast<int>(i));
  std::ranges::sort(ids);
  return ids;
}

bool ObservationStore::Snapshot::uses_hull_distance() const { return generation_->first().uses_hull_distance(); }

ObservationStore::ObservationStore(Declaration declaration, const Observations& observations,
                                   std::span<const double> domain_lower, std::span<const double> domain_upper,
                                   const StoreOptions& options)
    : declaration_(std::move(declaration)),
      domain_lower_(domain_lower.begin(), domain_lower.end()),
      domain_upper_(domain_upper.begin(), domain_upper.end()),
      options_(options),
      limits_(ToSize(observations.num_states())) {
  declaration_.Validate(observations.num_states(), static_cast<int>(observations.z.cols()));
  if (observations.size() == 0) throw std::invalid_argument("observation store: none given, at least one is needed");
  if (options.tail_capacity < 1 || options.tail_capacity > EnvelopeTail::kMaxCapacity)
    throw std::invalid_argument("observation store: tail_capacity " + std::to_string(options.tail_capacity) +
                                " is outside [1, " + std::to_string(EnvelopeTail::kMaxCapacity) + "]");
  if (options.max_observations < 1)
    throw std::invalid_argument("observation store: max_observations must be at least 1");
  next_id_ = observations.size();
  ObservationRows rows(static_cast<int>(observations.z.cols()), observations.num_states());
  const auto entries = [](const Eigen::RowVectorXd& row) { return std::vector<double>(row.begin(), row.end()); };
  for (int i = 0; i < next_id_; ++i)
    rows.Append(i, entries(observations.z.row(i)), entries(observations.lower.row(i)),
                entries(observations.upper.row(i)));
  // Where not all are kept, the contradiction has to be known before: Build then keeps all.
  const bool keeps_all = ToSize(next_id_) <= options_.max_observations;
  if (!keeps_all) violation_ = FindViolation(declaration_, observations);
  current_ = Build(std::move(rows), {});
  for (std::size_t k = 0; k < limits_.size(); ++k) limits_[k] = current_->first().value_limit(static_cast<int>(k));
  if (keeps_all) violation_ = FindViolation(declaration_, observations, &current_->first());
}

ObservationStore::~ObservationStore() = default;

ObservationStore::Snapshot ObservationStore::snapshot() const {
  Snapshot snapshot;
  const std::lock_guard lock(current_lock_);
  snapshot.generation_ = current_;
  snapshot.tail_size_ = current_->tail.size();
  snapshot.violation_ = violation_;
  return snapshot;
}

bool ObservationStore::Violated() const {
  const std::lock_guard lock(current_lock_);
  return violation_.has_value();
}

int ObservationStore::tail_size() const {
  const std::lock_guard lock(current_lock_);
  return current_->tail.size();
}

// Indexes the rows behind the pieces: in one more of them, or all in one where not all have room.
std::shared_ptr<ObservationStore::Generation> ObservationStore::Build(ObservationRows rows,
                                                                      std::vector<Piece> pieces) const {
  // A contradiction must not be forgotten for want of room.
  if (ToSize(rows.size()) > options_.max_observations && !Violated()) {
    std::vector<int> all(ToSize(rows.size()));
    std::iota(all.begin(), all.end(), 0);
    ObservationRows kept = rows.First(0);
    for (const int i : MostUseful(declaration_, rows.Select(all), options_.max_observations)) kept.Append(rows, i);
    rows = std::move(kept);
    pieces.clear();
  }
  const LastRows last{rows, pieces.empty() ? 0 : pieces.back().end};
  const auto index =
      std::make_shared<LipschitzEnvelope>(declaration_, last, domain_lower_, domain_upper_, options_.envelope);
  index->RaiseLimits(limits_);
  pieces.push_back({index, rows.size()});
  return std::make_shared<Generation>(declaration_, std::move(rows), std::move(pieces), options_.tail_capacity);
}

void ObservationStore::Compact() { Merge(true); }

void ObservationStore::Merge(bool all) {
  constexpr int kMuchLarger = 4;  // times
  const std::lock_guard compacting(compacting_);
  std::shared_ptr<Generation> old;
  int merged = 0;
  {
    const std::lock_guard writing(writing_);
    old = current_;
    merged = old->tail.size();
  }
  if (!all && old->HasRoom()) return;
  // Built without the lock, so that others may insert. Generations are replaced under compacting_ alone, so `old` stays
  // the one that they append to.
  const int end = old->indexed() + merged;
  std::vector<Piece> pieces = old->pieces;
  const auto first_of_last = [&] { return pieces.size() > 1 ? std::prev(pieces.end(), 2)->end : 0; };
  while (!pieces.empty() && (all || pieces.back().end - first_of_last() <= kMuchLarger * (end - pieces.back().end)))
    pieces.pop_back();
  const std::shared_ptr<Generation> fresh = Build(old->rows.First(end), std::move(pieces));
  const std::lock_guard writing(writing_);
  Replace(*old, fresh, merged);
}

// E_k has to hold for the entry, too.
void ObservationStore::RaiseLimits(const Entry& entry) {
  const std::lock_guard compacting(compacting_);
  const std::lock_guard writing(writing_);
  for (std::size_t k = 0; k < limits_.size(); ++k)
    limits_[k] = std::max(limits_[k], AddUp(std::max(std::abs(entry.lower[k]), std::abs(entry.upper[k])),
                                            declaration_.ObservationError(static_cast<Eigen::Index>(k))));
  std::vector<Piece> pieces = current_->pieces;
  for (Piece& piece : pieces) {
    const auto raised = std::make_shared<LipschitzEnvelope>(*piece.envelope);
    raised->RaiseLimits(limits_);
    piece.envelope = raised;
  }
  Replace(*current_,
          std::make_shared<Generation>(declaration_, current_->rows.First(current_->indexed()), pieces,
                                       options_.tail_capacity),
          0);
}

// What was inserted into `old` meanwhile, behind the first `merged` entries of its tail, comes along. @pre both locks.
void ObservationStore::Replace(const Generation& old, std::shared_ptr<Generation> fresh, int merged) {
  const ObservationRows& rows = old.rows;
  const int size = old.tail.size();
  for (int i = merged; i < size; ++i) {
    const int row = old.indexed() + i;
    fresh->Append(rows.id(row), {rows.z(row), rows.lower(row), rows.upper(row)});
  }
  const std::lock_guard lock(current_lock_);
  current_.swap(fresh);  // the old one is destroyed after the lock is released, unless a snapshot holds it
}

// One new observation against those of a generation.
class ObservationStore::PartnerSearch {
 public:
  PartnerSearch(const ObservationStore& store, const Entry& entry, int id)
      : store_(store), generation_(*store.current_), entry_(entry), id_(id), is_consistent_(!store.Violated()) {}

  std::optional<Violation> FindPartner() {
    for (int k = 0; k < generation_.first().num_states(); ++k)
      if ((Row(k).is_constant() ? TestConstant(k) : TestRow(k)) && found_) return found_;
    return std::nullopt;
  }

 private:
  // The tests below return whether nothing more has to be tested in coordinate k: there is a contradiction, or none.

  // Only where the extremes leave it open, by a last bit, does it take looking at all.
  bool TestConstant(int k) {
    const Point point = PointIn(k);
    const int size = generation_.tail.size();
    double highest = generation_.tail.HighestFloor(k, size);
    double lowest = -generation_.tail.HighestNegatedCeiling(k, size);
    for (const Piece& piece : generation_.pieces) {
      highest = std::max(highest, piece.envelope->highest_floor(k));
      lowest = std::min(lowest, piece.envelope->lowest_ceiling(k));
    }
    const bool open = NextUp(point.floor) > NextDown(lowest) || NextUp(highest) > NextDown(-point.negated_ceiling);
    return open && TestAll(k);
  }

  // Pieces by their trees, the tail block by block.
  bool TestRow(int k) {
    const double margin = generation_.first().pair_margin(k);
    if (!std::isfinite(margin)) return TestAll(k);
    const Point point = PointIn(k);
    int first = 0;
    for (const Piece& piece : generation_.pieces) {
      const PairSearch search(piece.envelope->index(k), margin, store_.options_.envelope.instructions);
      if (search.AnyPartner(point, [&](std::uint32_t j) { return Test(first + static_cast<int>(j), k); })) return true;
      first = piece.end;
    }
    std::vector<std::uint32_t> partners;
    PairSearch::Suspects(point, Row(k), generation_.tail.blocks(k), ToSize(generation_.tail.size()), margin, partners);
    return std::ranges::any_of(partners, [&](std::uint32_t j) { return TestInTail(static_cast<int>(j), k); });
  }

  bool TestAll(int k) {
    for (int row = 0; row < generation_.rows.size(); ++row)
      if (Test(row, k)) return true;
    return false;
  }

  bool TestInTail(int j, int k) { return Test(generation_.indexed() + j, k); }

  bool Test(int row, int k) {
    const ObservationRows& rows = generation_.rows;
    if (is_consistent_ && IsWithin(rows, row, k)) return true;
    Observations two = rows.Select(std::array{row, row});
    const auto set = [](Eigen::MatrixXd& matrix, std::span<const double> values) {
      matrix.row(1) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), std::ssize(values));
    };
    set(two.z, entry_.z), set(two.lower, entry_.lower), set(two.upper, entry_.upper);
    found_ = TestPair(store_.declaration_, two, 0, 1, k);
    if (!found_) return false;
    found_->first = rows.id(row);
    found_->second = id_;
    return true;
  }

  // Whether this entry contradicts only what observation j contradicts: it has the same location in the columns of the
  // row, and a residual that contains j's.
  [[nodiscard]] bool IsWithin(const ObservationRows& o, int j, int k) const {
    return entry_.lower[ToSize(k)] <= o.lower(j, k) && o.upper(j, k) <= entry_.upper[ToSize(k)] &&
           std::ranges::all_of(Row(k).columns(), [&](const LipschitzRow::Column& column) {
             return entry_.z[ToSize(column.variable)] == o.z(j, column.variable);
           });
  }

  [[nodiscard]] const LipschitzRow& Row(int k) const { return generation_.first().row(k); }

  using Point = PairSearch::Point;
  [[nodiscard]] Point PointIn(int k) const {
    const auto i = ToSize(k);
    const double error = store_.declaration_.ObservationError(k);
    const LipschitzRow& row = Row(k);
    Point point{std::vector<double>(row.num_coordinates()), SubDown(entry_.lower[i], error),
                -AddUp(entry_.upper[i], error)};
    row.Map([&](int l) { return entry_.z[ToSize(l)]; }, point.coordinates.data());
    return point;
  }

  const ObservationStore& store_;
  const Generation& generation_;
  const Entry& entry_;
  int id_;
  bool is_consistent_;  // no two of the others contradict each other
  std::optional<Violation> found_;
};

ObservationStore::Insertion ObservationStore::Insert(std::span<const double> z, std::span<const double> lower,
                                                     std::span<const double> upper) {
  for (std::size_t l = 0; l < domain_lower_.size(); ++l)
    // The declaration speaks of the domain, and the error of an answer is computed for it. NaN is outside.
    if (!(domain_lower_[l] <= z[l] && z[l] <= domain_upper_[l])) return {};
  for (std::size_t k = 0; k < lower.size(); ++k)
    if (!(-kInfinity < lower[k] && lower[k] <= upper[k] && upper[k] < kInfinity)) return {};

  const Entry entry{z, lower, upper};
  std::unique_lock writing(writing_);
  while (!current_->HasRoom() || !current_->tail.Covers(lower, upper)) {
    const bool is_full = !current_->HasRoom();
    writing.unlock();  // compacting_ is taken before writing_ everywhere
    is_full ? Merge(false) : RaiseLimits(entry);
    writing.lock();
  }
  const Insertion insertion = Enlist(entry);
  current_->Append(insertion.id, entry);
  return insertion;
}

ObservationStore::Insertion ObservationStore::Enlist(const Entry& entry) {
  const int id = next_id_++;
  Insertion insertion{id, PartnerSearch(*this, entry, id).FindPartner()};
  if (insertion.violation) {
    const std::lock_guard lock(current_lock_);
    // The first contradiction stays: it is a proof, and nothing that comes later takes it back.
    if (!violation_) violation_ = insertion.violation;
  }
  return insertion;
}

}  // namespace forereach
