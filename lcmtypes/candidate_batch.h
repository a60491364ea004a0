/** Many candidates in one message, and what a message on the candidates' channel stands for.

A batch is no more than its candidates: each has the bytes and the digest that it would have if it was sent alone. So
decisions, seals and records speak of candidates, and whoever reads a batch expands it. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "forereach/candidate_batch_t.hpp"
#include "forereach/candidate_plan_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

/** The largest K, and the numbers that all controls of a batch may have. One datagram holds them. */
inline constexpr int kMaxBatch = 256, kMaxBatchNumbers = 7680;

/** Whether the bytes have the fingerprint of a batch; they need not be one. */
[[nodiscard]] bool IsBatch(Bytes message);

/** Why the batch stands for no candidates: a count is out of its range, the controls do not fit, or a plan_id
overflows. Empty if it stands for some. Numbers and times are not looked at. */
[[nodiscard]] std::string WhyNoBatch(const candidate_batch_t& batch);

/** Where the controls of candidate k begin in `control`. @pre WhyNoBatch is empty, k is one of the batch. */
[[nodiscard]] int FirstNumberOf(const candidate_batch_t& batch, int k);

/** Candidate k as it would be sent alone. @pre as above. */
[[nodiscard]] candidate_plan_t CandidateOf(const candidate_batch_t& batch, int k);

/** Appends a candidate. The first one gives a batch of zeros all that candidates share. False, and nothing is changed,
if there is no room or its counts are out of range. @pre the others agree with the first in everything but steps and
controls, and its plan_id is the next one. */
[[nodiscard]] bool Append(candidate_batch_t& batch, const candidate_plan_t& candidate);

/** By what a message with candidates is found again for the decision on one of them: its digest; of one that stands for
many, which would cost 10 us for each, BatchKey. */
[[nodiscard]] Digest KeyOfCandidates(Bytes message);

/** The key of a batch, by the source and the stamp that decisions repeat. */
[[nodiscard]] Digest BatchKey(const std::uint8_t (&source)[32], std::int64_t utime);

/** The bytes of the candidate with this digest: those of one of a batch, otherwise of the message itself. */
[[nodiscard]] std::vector<std::uint8_t> CandidateIn(Bytes message, const Digest& plan);

}  // namespace forereach
