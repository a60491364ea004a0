#include "forereach/residual/observation_store.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "forereach/numerics/size.h"
#include "forereach/residual/pairs.h"
#include "forereach/residual/retention.h"

namespace forereach {
namespace {

std::span<const double> View(const Eigen::VectorXd& x) { return {x.data(), ToSize(x.size())}; }

}  // namespace

// One observation: d_z and n entries.
struct ObservationStore::Entry {
  std::span<const double> z, lower, upper;

  void WriteTo(Observations& observations, int row) const {
    const auto write = [row](Eigen::MatrixXd& matrix, std::span<const double> values) {
      matrix.row(row) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), std::ssize(values));
    };
    write(observations.z, z);
    write(observations.lower, lower);
    write(observations.upper, upper);
  }
};

// Observations and their ids, row by row.
struct ObservationStore::Known {
  Observations observations;
  std::vector<int> ids;

  // Room for so many rows of the sizes of others.
  static Known WithRows(int rows, const Observations& like) {
    const int n = like.num_states();
    return {{Eigen::MatrixXd(rows, like.z.cols()), Eigen::MatrixXd(rows, n), Eigen::MatrixXd(rows, n)},
            std::vector<int>(ToSize(rows))};
  }

  void Set(int row, int id, const Entry& entry) {
    entry.WriteTo(observations, row);
    ids[ToSize(row)] = id;
  }
};

// An index and its tail. Entries of the tail below its size do not change any more, and neither does the index.
struct ObservationStore::Generation {
  Known indexed;
  LipschitzEnvelope envelope;
  EnvelopeTail tail;
  Known in_tail;  // as many rows as the tail may hold

  Generation(const Declaration& declaration, Known known, std::span<const double> lower, std::span<const double> upper,
             const StoreOptions& options)
      : indexed(std::move(known)),
        envelope(declaration, indexed.observations, lower, upper, options.envelope),
        tail(declaration, envelope, options.tail_capacity),
        in_tail(Known::WithRows(options.tail_capacity, indexed.observations)) {}

  // The index's observations, the first `tail_size` of the tail, and room for `more`.
  [[nodiscard]] Known All(int tail_size, int more = 0) const {
    const Observations &early = indexed.observations, &late = in_tail.observations;
    Known all = Known::WithRows(early.size() + tail_size + more, early);
    const auto join = [&](Eigen::MatrixXd Observations::*part) {
      (all.observations.*part).topRows(early.size()) = early.*part;
      (all.observations.*part).middleRows(early.size(), tail_size) = (late.*part).topRows(tail_size);
    };
    join(&Observations::z);
    join(&Observations::lower);
    join(&Observations::upper);
    std::copy_n(in_tail.ids.begin(), tail_size, std::ranges::copy(indexed.ids, all.ids.begin()).out);
    return all;
  }

  [[nodiscard]] bool HasRoom() const { return tail.size() < tail.capacity(); }

  void Append(int id, const Entry& entry) {
    in_tail.Set(tail.size(), id, entry);
    tail.Append(entry.z, entry.lower, entry.upper);
  }
};

void ObservationStore::Snapshot::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  generation_->envelope.Enclose(query, generation_->tail, tail_size_, bounds);
}

std::size_t ObservationStore::Snapshot::size() const { return generation_->indexed.ids.size() + ToSize(tail_size_); }

std::vector<int> ObservationStore::Snapshot::ids() const {
  std::vector<int> ids = generation_->indexed.ids;
  ids.insert(ids.end(), generation_->in_tail.ids.begin(), generation_->in_tail.ids.begin() + tail_size_);
  std::ranges::sort(ids);
  return ids;
}

bool ObservationStore::Snapshot::uses_hull_distance() const { return generation_->envelope.uses_hull_distance(); }

ObservationStore::ObservationStore(Declaration declaration, const Observations& observations,
                                   std::span<const double> domain_lower, std::span<const double> domain_upper,
                                   const StoreOptions& options)
    : declaration_(std::move(declaration)),
      domain_lower_(domain_lower.begin(), domain_lower.end()),
      domain_upper_(domain_upper.begin(), domain_upper.end()),
      options_(options) {
  declaration_.Validate(observations.num_states(), static_cast<int>(observations.z.cols()));
  if (observations.size() == 0) throw std::invalid_argument("observation store: none given, at least one is needed");
  if (options.tail_capacity < 1 || options.tail_capacity > EnvelopeTail::kMaxCapacity)
    throw std::invalid_argument("observation store: tail_capacity " + std::to_string(options.tail_capacity) +
                                " is outside [1, " + std::to_string(EnvelopeTail::kMaxCapacity) + "]");
  if (options.max_observations < 1)
    throw std::invalid_argument("observation store: max_observations must be at least 1");
  options_.envelope.value_headroom = kValueHeadroom;
  next_id_ = observations.size();
  std::vector<int> ids(ToSize(next_id_));
  std::iota(ids.begin(), ids.end(), 0);
  // Where not all are kept, the contradiction has to be known before: Build then keeps all.
  const bool keeps_all = ids.size() <= options_.max_observations;
  if (!keeps_all) violation_ = FindViolation(declaration_, observations);
  current_ = Build({observations, std::move(ids)});
  if (keeps_all) violation_ = FindViolation(declaration_, current_->indexed.observations, &current_->envelope);
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

void ObservationStore::Swap(std::shared_ptr<Generation> generation) {
  const std::lock_guard lock(current_lock_);
  current_.swap(generation);  // the old one is destroyed after the lock is released, unless a snapshot holds it
}

std::shared_ptr<ObservationStore::Generation> ObservationStore::Build(Known known) const {
  // A contradiction must not be forgotten for want of room.
  if (known.ids.size() > options_.max_observations && !Violated()) {
    const std::vector<int> kept = MostUseful(declaration_, known.observations, options_.max_observations);
    known.observations = Select(known.observations, kept);
    for (std::size_t i = 0; i < kept.size(); ++i) known.ids[i] = known.ids[ToSize(kept[i])];
    known.ids.resize(kept.size());
  }
  return std::make_shared<Generation>(declaration_, std::move(known), domain_lower_, domain_upper_, options_);
}

void ObservationStore::Compact() {
  const std::lock_guard compacting(compacting_);
  std::shared_ptr<Generation> old;
  int merged = 0;
  {
    const std::lock_guard writing(writing_);
    old = current_;
    merged = old->tail.size();
  }
  // Built without the lock, so that others may insert. Generations are swapped under compacting_ alone, so `old` stays
  // the one that they append to.
  std::shared_ptr<Generation> fresh = Build(old->All(merged));
  const std::lock_guard writing(writing_);
  // Entries that were inserted during Build.
  const int size = old->tail.size();
  const Observations& tail = old->in_tail.observations;
  for (int i = merged; i < size; ++i) {
    const Eigen::VectorXd z = tail.z.row(i), lower = tail.lower.row(i), upper = tail.upper.row(i);
    if (!fresh->tail.Covers(View(lower), View(upper))) {  // rare enough to wait for
      fresh = Build(old->All(size));
      break;
    }
    fresh->Append(old->in_tail.ids[ToSize(i)], {View(z), View(lower), View(upper)});
  }
  Swap(std::move(fresh));
}

// One new observation against those of a generation.
class ObservationStore::PartnerSearch {
 public:
  PartnerSearch(const ObservationStore& store, const Entry& entry, int id)
      : store_(store), generation_(*store.current_), entry_(entry), id_(id), is_consistent_(!store.Violated()) {}

  std::optional<Violation> FindPartner() {
    for (int k = 0; k < generation_.envelope.num_states(); ++k)
      if ((generation_.envelope.row(k).is_constant() ? TestConstant(k) : TestRow(k)) && found_) return found_;
    return std::nullopt;
  }

 private:
  // The tests below return whether nothing more has to be tested in coordinate k: there is a contradiction, or none.

  // Only where the extremes leave it open, by a last bit, does it take looking at all.
  bool TestConstant(int k) {
    const Point point = PointIn(k);
    const int size = generation_.tail.size();
    const double highest = std::max(generation_.envelope.highest_floor(k), generation_.tail.HighestFloor(k, size));
    const double lowest =
        std::min(generation_.envelope.lowest_ceiling(k), -generation_.tail.HighestNegatedCeiling(k, size));
    const bool open = NextUp(point.floor) > NextDown(lowest) || NextUp(highest) > NextDown(-point.negated_ceiling);
    return open && TestAll(k);
  }

  // The index by its tree, the tail block by block.
  bool TestRow(int k) {
    const double margin = generation_.envelope.pair_margin(k);
    if (!std::isfinite(margin) || !generation_.tail.Covers(entry_.lower, entry_.upper)) return TestAll(k);
    const Point point = PointIn(k);
    const PairSearch search(generation_.envelope.index(k), margin, store_.options_.envelope.instructions);
    if (search.AnyPartner(point, [&](std::uint32_t j) { return TestIndexed(static_cast<int>(j), k); })) return true;
    std::vector<std::uint32_t> partners;
    PairSearch::Suspects(point, generation_.envelope.row(k), generation_.tail.blocks(k),
                         ToSize(generation_.tail.size()), margin, partners);
    return std::ranges::any_of(partners, [&](std::uint32_t j) { return TestInTail(static_cast<int>(j), k); });
  }

  bool TestAll(int k) {
    for (int j = 0; j < generation_.indexed.observations.size(); ++j)
      if (TestIndexed(j, k)) return true;
    for (int j = 0; j < generation_.tail.size(); ++j)
      if (TestInTail(j, k)) return true;
    return false;
  }

  bool TestIndexed(int j, int k) { return Test(generation_.indexed, j, k); }
  bool TestInTail(int j, int k) { return Test(generation_.in_tail, j, k); }

  bool Test(const Known& others, int j, int k) {
    if (is_consistent_ && IsWithin(others.observations, j, k)) return true;
    Observations two = Select(others.observations, {j, j});
    entry_.WriteTo(two, 1);
    found_ = TestPair(store_.declaration_, two, 0, 1, k);
    if (!found_) return false;
    found_->first = others.ids[ToSize(j)];
    found_->second = id_;
    return true;
  }

  // Whether this entry contradicts only what observation j contradicts: it has the same location in the columns of the
  // row, and a residual that contains j's.
  [[nodiscard]] bool IsWithin(const Observations& o, int j, int k) const {
    return entry_.lower[ToSize(k)] <= o.lower(j, k) && o.upper(j, k) <= entry_.upper[ToSize(k)] &&
           std::ranges::all_of(generation_.envelope.row(k).columns(), [&](const LipschitzRow::Column& column) {
             return entry_.z[ToSize(column.variable)] == o.z(j, column.variable);
           });
  }

  using Point = PairSearch::Point;
  [[nodiscard]] Point PointIn(int k) const {
    const auto i = ToSize(k);
    const double error = store_.declaration_.ObservationError(k);
    const LipschitzRow& row = generation_.envelope.row(k);
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
    const bool full = !current_->HasRoom();
    writing.unlock();  // compacting_ is taken before writing_ everywhere
    if (full) {
      Compact();
      writing.lock();
      continue;
    }
    const std::lock_guard compacting(compacting_);
    const std::lock_guard again(writing_);
    // Too large for the error bound of the index: into a new one at once.
    const Insertion insertion = Enlist(entry);
    Known all = current_->All(current_->tail.size(), 1);
    all.Set(all.observations.size() - 1, insertion.id, entry);
    Swap(Build(std::move(all)));
    return insertion;
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
