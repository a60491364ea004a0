#include "lcmtypes/candidate_batch.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <optional>

#include "lcmtypes/seal.h"

namespace forereach {
namespace {

static_assert(std::extent_v<decltype(candidate_batch_t::num_steps)> == kMaxBatch &&
              std::extent_v<decltype(candidate_batch_t::control)> == kMaxBatchNumbers);
constexpr int kMaxSteps = std::extent_v<decltype(candidate_plan_t::control)>;
constexpr int kMaxInputs = std::extent_v<decltype(candidate_plan_t::control), 1>;
constexpr int kMaxStates = std::extent_v<decltype(candidate_plan_t::initial_center)>;

bool IsIn(int number, int least, int most) { return least <= number && number <= most; }

std::string Wrong(const std::string& what, std::int64_t found, const std::string& range) {
  return what + " is " + std::to_string(found) + ", must be " + range;
}

// Everything but steps and controls.
template <class From, class To>
void CopyShared(const From& from, To& to) {
  to.utime = from.utime;
  to.sequence = from.sequence;
  to.plan_id = from.plan_id;
  to.start_utime = from.start_utime;
  to.step_us = from.step_us;
  to.num_states = from.num_states;
  to.num_inputs = from.num_inputs;
  to.repair = from.repair;
  std::ranges::copy(from.source, to.source);
  std::ranges::copy(from.initial_center, to.initial_center);
  std::ranges::copy(from.initial_half_width, to.initial_half_width);
}

std::optional<candidate_batch_t> BatchIn(Bytes message) {
  if (!IsBatch(message)) return std::nullopt;
  std::optional<candidate_batch_t> batch = Decoded<candidate_batch_t>(message);
  if (batch && !WhyNoBatch(*batch).empty()) batch.reset();
  return batch;
}

}  // namespace

bool IsBatch(Bytes message) {
  return message.size() >= sizeof(std::int64_t) && FromBigEndian<std::int64_t>(message) == candidate_batch_t::getHash();
}

std::string WhyNoBatch(const candidate_batch_t& batch) {
  if (!IsIn(batch.num_states, 1, kMaxStates)) return Wrong("num_states", batch.num_states, "1 to 16");
  if (!IsIn(batch.num_inputs, 1, kMaxInputs)) return Wrong("num_inputs", batch.num_inputs, "1 to 8");
  if (!IsIn(batch.num_candidates, 1, kMaxBatch)) return Wrong("num_candidates", batch.num_candidates, "1 to 256");
  if (batch.plan_id > std::numeric_limits<std::int64_t>::max() - kMaxBatch)
    return Wrong("plan_id", batch.plan_id, "at most 2^63 - 257");
  int numbers = 0;
  for (int k = 0; k < batch.num_candidates; ++k) {
    if (!IsIn(batch.num_steps[k], 1, kMaxSteps))
      return Wrong("num_steps[" + std::to_string(k) + "]", batch.num_steps[k], "1 to 128");
    if (!IsIn(batch.progress_steps[k], 0, batch.num_steps[k]))
      return Wrong("progress_steps[" + std::to_string(k) + "]", batch.progress_steps[k], "0 to its num_steps");
    numbers += batch.num_steps[k] * batch.num_inputs;
  }
  if (numbers > kMaxBatchNumbers) return Wrong("the number of its controls' numbers", numbers, "at most 7680");
  return {};
}

int FirstNumberOf(const candidate_batch_t& batch, int k) {
  int numbers = 0;
  for (int i = 0; i < k; ++i) numbers += batch.num_steps[i] * batch.num_inputs;
  return numbers;
}

candidate_plan_t CandidateOf(const candidate_batch_t& batch, int k) {
  candidate_plan_t candidate{};
  CopyShared(batch, candidate);
  candidate.plan_id += k;
  candidate.num_steps = batch.num_steps[k];
  candidate.progress_steps = batch.progress_steps[k];
  const double* number = batch.control + FirstNumberOf(batch, k);
  for (int t = 0; t < candidate.num_steps; ++t, number += batch.num_inputs)
    std::copy_n(number, batch.num_inputs, candidate.control[t]);
  // What is not in use is zero, as of one that is sent alone.
  std::fill(candidate.initial_center + batch.num_states, std::end(candidate.initial_center), 0.0);
  std::fill(candidate.initial_half_width + batch.num_states, std::end(candidate.initial_half_width), 0.0);
  return candidate;
}

bool Append(candidate_batch_t& batch, const candidate_plan_t& candidate) {
  const int k = batch.num_candidates;
  if (!IsIn(candidate.num_inputs, 1, kMaxInputs) || !IsIn(candidate.num_steps, 1, kMaxSteps) || k == kMaxBatch)
    return false;
  const int first = FirstNumberOf(batch, k);
  if (first + candidate.num_steps * candidate.num_inputs > kMaxBatchNumbers) return false;
  if (k == 0) CopyShared(candidate, batch);
  batch.num_steps[k] = candidate.num_steps;
  batch.progress_steps[k] = candidate.progress_steps;
  double* number = batch.control + first;
  for (int t = 0; t < candidate.num_steps; ++t)
    number = std::copy_n(candidate.control[t], candidate.num_inputs, number);
  ++batch.num_candidates;
  return true;
}

Digest KeyOfCandidates(Bytes message) {
  const auto batch = BatchIn(message);
  return batch ? BatchKey(batch->source, batch->utime) : PlanDigest(message);
}

Digest BatchKey(const std::uint8_t (&source)[32], std::int64_t utime) {
  std::vector<std::uint8_t> bytes(std::begin(source), std::end(source));
  const auto stamp = BigEndian(utime);
  bytes.insert(bytes.end(), stamp.begin(), stamp.end());
  return DigestOf(Bytes(bytes));
}

std::vector<std::uint8_t> CandidateIn(Bytes message, const Digest& plan) {
  if (const auto batch = BatchIn(message))
    for (int k = 0; k < batch->num_candidates; ++k)
      if (std::vector<std::uint8_t> bytes = Encode(CandidateOf(*batch, k)); PlanDigest(bytes) == plan) return bytes;
  return {message.begin(), message.end()};
}

}  // namespace forereach
