#include "certifier/residual/observation_store.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "certifier/numerics/size.h"
#include "certifier/residual/pairs.h"
#include "certifier/residual/retention.h"

namespace forereach {
namespace {

std::span<const double> View(const Eigen::VectorXd& x) { return {x.data(), ToSize(x.size())}; }

void SetRow(Eigen::MatrixXd& matrix, int row, std::span<const double> values) {
  matrix.row(row) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

}  // namespace

// Observations and their ids, row by row.
struct ObservationStore::Known {
  Observations observations;
  std::vector<int> ids;

  void Append(int id, std::span<const double> z, std::span<const double> lower, std::span<const double> upper) {
    const int row = observations.size();
    for (Eigen::MatrixXd* matrix : {&observations.z, &observations.lower, &observations.upper})
      matrix->conservativeResize(row + 1, Eigen::NoChange);
    SetRow(observations.z, row, z);
    SetRow(observations.lower, row, lower);
    SetRow(observations.upper, row, upper);
    ids.push_back(id);
  }
};

// An index and its tail. Entries of the tail below its size do not change any more, and neither does the index.
struct ObservationStore::Generation {
  Observations observations;  // of the index
  std::vector<int> ids;
  LipschitzEnvelope envelope;
  std::vector<double> margins;  // of the pairwise test, row by row
  EnvelopeTail tail;
  Observations tail_observations;  // as many rows as the tail may hold
  std::vector<int> tail_ids;

  Generation(const Declaration& declaration, Observations all, std::vector<int> all_ids, std::span<const double> lower,
             std::span<const double> upper, const StoreOptions& options)
      : observations(std::move(all)),
        ids(std::move(all_ids)),
        envelope(declaration, observations, lower, upper, options.envelope),
        tail(declaration, envelope, options.tail_capacity),
        tail_observations{Eigen::MatrixXd(options.tail_capacity, observations.z.cols()),
                          Eigen::MatrixXd(options.tail_capacity, observations.num_states()),
                          Eigen::MatrixXd(options.tail_capacity, observations.num_states())},
        tail_ids(ToSize(options.tail_capacity)) {
    for (int k = 0; k < envelope.num_states(); ++k) {
      double locations = 0;
      for (const LipschitzRow::Column& column : envelope.row(k).columns()) {
        const auto l = ToSize(column.variable);
        const double farthest = std::max(
            {observations.z.col(column.variable).cwiseAbs().maxCoeff(), std::abs(lower[l]), std::abs(upper[l])});
        locations = AddUp(locations, MulUp(column.slope, farthest));
      }
      margins.push_back(PairMarginUpper(envelope.value_limit(k), locations, envelope.row(k).columns().size()));
    }
  }

  // With the tail's first entries.
  [[nodiscard]] Known All(int tail_size) const {
    const Eigen::Index rows = observations.size() + tail_size;
    Known all{{Eigen::MatrixXd(rows, observations.z.cols()), Eigen::MatrixXd(rows, observations.num_states()),
               Eigen::MatrixXd(rows, observations.num_states())},
              ids};
    all.observations.z << observations.z, tail_observations.z.topRows(tail_size);
    all.observations.lower << observations.lower, tail_observations.lower.topRows(tail_size);
    all.observations.upper << observations.upper, tail_observations.upper.topRows(tail_size);
    all.ids.insert(all.ids.end(), tail_ids.begin(), tail_ids.begin() + tail_size);
    return all;
  }

  [[nodiscard]] bool HasRoom() const { return tail.size() < tail.capacity(); }

  void Append(int id, std::span<const double> z, std::span<const double> lower, std::span<const double> upper) {
    const int row = tail.size();
    tail_ids[ToSize(row)] = id;
    SetRow(tail_observations.z, row, z);
    SetRow(tail_observations.lower, row, lower);
    SetRow(tail_observations.upper, row, upper);
    tail.Append(z, lower, upper);
  }
};

void ObservationStore::Snapshot::Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept {
  generation_->envelope.Enclose(query, generation_->tail, tail_size_, bounds);
}

std::size_t ObservationStore::Snapshot::size() const { return generation_->ids.size() + ToSize(tail_size_); }

Observations ObservationStore::Snapshot::Contradiction() const {
  const Known all = generation_->All(tail_size_);
  std::vector<int> rows;
  for (std::size_t i = 0; i < all.ids.size(); ++i)
    if (all.ids[i] == violation_->first || all.ids[i] == violation_->second) rows.push_back(static_cast<int>(i));
  return Select(all.observations, rows);
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
  if (keeps_all) violation_ = FindViolation(declaration_, current_->observations, current_->envelope);
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
  return std::make_shared<Generation>(declaration_, std::move(known.observations), std::move(known.ids), domain_lower_,
                                      domain_upper_, options_);
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
  std::shared_ptr<Generation> fresh = Build(old->All(merged));
  const std::lock_guard writing(writing_);
  // What came in meanwhile.
  const int size = old->tail.size();
  const Observations& tail = old->tail_observations;
  for (int i = merged; i < size; ++i) {
    const Eigen::VectorXd z = tail.z.row(i), lower = tail.lower.row(i), upper = tail.upper.row(i);
    if (!fresh->tail.Covers(View(lower), View(upper))) {  // rare enough to wait for
      fresh = Build(old->All(size));
      break;
    }
    fresh->Append(old->tail_ids[ToSize(i)], View(z), View(lower), View(upper));
  }
  Swap(std::move(fresh));
}

// One new observation against those of a generation.
class ObservationStore::PartnerSearch {
 public:
  PartnerSearch(const ObservationStore& store, std::span<const double> z, std::span<const double> lower,
                std::span<const double> upper, int id)
      : store_(store), generation_(*store.current_), z_(z), lower_(lower), upper_(upper), id_(id) {}

  std::optional<Violation> FindPartner() {
    for (int k = 0; k < generation_.envelope.num_states(); ++k)
      if (generation_.envelope.row(k).is_constant() ? TestConstant(k) : TestRow(k)) return found_;
    return std::nullopt;
  }

 private:
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
    const double margin = generation_.margins[ToSize(k)];
    if (!std::isfinite(margin) || !generation_.tail.Covers(lower_, upper_)) return TestAll(k);
    const Point point = PointIn(k);
    const PairSearch search(generation_.envelope.index(k), margin, store_.options_.envelope.instructions);
    if (search.AnyPartner(point, [&](std::uint32_t j) { return TestIndexed(static_cast<int>(j), k); })) return true;
    std::vector<std::uint32_t> partners;
    PairSearch::Suspects(point, generation_.envelope.row(k), generation_.tail.blocks(k),
                         ToSize(generation_.tail.size()), margin, partners);
    return std::ranges::any_of(partners, [&](std::uint32_t j) { return TestInTail(static_cast<int>(j), k); });
  }

  bool TestAll(int k) {
    for (int j = 0; j < generation_.observations.size(); ++j)
      if (TestIndexed(j, k)) return true;
    for (int j = 0; j < generation_.tail.size(); ++j)
      if (TestInTail(j, k)) return true;
    return false;
  }

  bool TestIndexed(int j, int k) { return Test(generation_.observations, j, generation_.ids, k); }
  bool TestInTail(int j, int k) { return Test(generation_.tail_observations, j, generation_.tail_ids, k); }

  bool Test(const Observations& others, int j, const std::vector<int>& ids, int k) {
    Observations two = Select(others, {j, j});
    SetRow(two.z, 1, z_);
    SetRow(two.lower, 1, lower_);
    SetRow(two.upper, 1, upper_);
    found_ = TestPair(store_.declaration_, two, 0, 1, k);
    if (!found_) return false;
    found_->first = ids[ToSize(j)];
    found_->second = id_;
    return true;
  }

  using Point = PairSearch::Point;
  [[nodiscard]] Point PointIn(int k) const {
    const auto i = ToSize(k);
    const double sigma = store_.declaration_.noise_bound[k];
    const LipschitzRow& row = generation_.envelope.row(k);
    Point point{std::vector<double>(row.num_coordinates()), SubDown(lower_[i], sigma), -AddUp(upper_[i], sigma)};
    row.Map([&](int l) { return z_[ToSize(l)]; }, point.coordinates.data());
    return point;
  }

  const ObservationStore& store_;
  const Generation& generation_;
  std::span<const double> z_, lower_, upper_;
  int id_;
  std::optional<Violation> found_;
};

ObservationStore::Insertion ObservationStore::Insert(std::span<const double> z, std::span<const double> lower,
                                                     std::span<const double> upper) {
  for (std::size_t l = 0; l < domain_lower_.size(); ++l)
    if (!(domain_lower_[l] <= z[l] && z[l] <= domain_upper_[l])) return {};
  for (std::size_t k = 0; k < lower.size(); ++k)
    if (!(-kInfinity < lower[k] && lower[k] <= upper[k] && upper[k] < kInfinity)) return {};

  std::unique_lock writing(writing_);
  while (!current_->HasRoom() || !current_->tail.Covers(lower, upper)) {
    const bool full = !current_->HasRoom();
    writing.unlock();
    if (full) {
      Compact();
      writing.lock();
      continue;
    }
    const std::lock_guard compacting(compacting_);
    const std::lock_guard again(writing_);
    // Too large for the error bound of the index: into a new one at once.
    const Insertion insertion = Enlist(z, lower, upper);
    Known all = current_->All(current_->tail.size());
    all.Append(insertion.id, z, lower, upper);
    Swap(Build(std::move(all)));
    return insertion;
  }
  const Insertion insertion = Enlist(z, lower, upper);
  current_->Append(insertion.id, z, lower, upper);
  return insertion;
}

ObservationStore::Insertion ObservationStore::Enlist(std::span<const double> z, std::span<const double> lower,
                                                     std::span<const double> upper) {
  const int id = next_id_++;
  Insertion insertion{id, PartnerSearch(*this, z, lower, upper, id).FindPartner()};
  if (insertion.violation) {
    const std::lock_guard lock(current_lock_);
    if (!violation_) violation_ = insertion.violation;
  }
  return insertion;
}

}  // namespace forereach
